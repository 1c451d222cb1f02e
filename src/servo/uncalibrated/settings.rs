//! How uncalibrated servoing behaves.

/// Settings of [`super::Uncalibrated`]. The defaults servo from any placement of two cameras; [`Settings::plain`] is the thesis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// λ: share of the errors that a step shall take away, in (0, 1]. Default 0.5.
    pub gain: f64,
    /// How the Jacobian is first found.
    pub exploration: Exploration,
    /// How it is kept while moving.
    pub update: Update,
    /// Share by which slopes change per unit of motion [1 per unit of the quantities], at first; an adaptive update corrects it. Default 0.7.
    pub curvature: f64,
    /// Where all trackers see whole pixels and errors are noise, places around are visited once, this far apart from the middle along each
    /// direction, root mean square over the rows [px]: in between, pixels are then known. 0 for none. Default 1.2.
    pub dither: f64,
    /// How far it is trusted; `None` takes every step whole.
    pub trust: Option<Trust>,
    /// Servoing stops where the sum of the absolute errors grows by more than this in one step [px]. Default 100, the thesis's.
    pub divergence: f64,
    /// Servoing begins only where the condition number of the Jacobian, over the rows' standard deviations, is below this, and explores
    /// again where it is lost on the way. Default 3000: well above that of one camera and three points in general position.
    pub worst_condition: f64,
}

/// Exploratory motions: out and back, one per direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Exploration {
    /// Size of the first motion along each direction [unit of the quantity]. Default 0.02.
    pub size: f64,
    /// Motions are enlarged until the root mean square of the change seen is this many standard deviations; 0 takes `size` as it is.
    /// Default 30: slopes are then known to 5 %.
    pub clarity: f64,
    /// Largest motion along a direction [unit of the quantity]. Default 0.2.
    pub largest: f64,
    /// Directions, at least as many as quantities and independent; empty moves each quantity down, one after the other, or up where
    /// there is no room below.
    pub directions: Vec<Vec<f64>>,
}

/// How a Jacobian follows what motions show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Update {
    /// It stays as explored.
    Keep,
    /// Broyden's update: the step of eq. (2.18) of the thesis.
    Broyden {
        /// α, in (0, 1].
        rate: f64,
        /// Updated only where both the change that was seen and its difference from the expected one exceed this many standard
        /// deviations; 0 updates always. With α = 1 and a tracker of whole pixels, 0 destroys the Jacobian.
        gate: f64,
    },
    /// Recursive least squares with forgetting.
    LeastSquares {
        /// How much older motions count, per motion, in (0, 1].
        forgetting: f64,
        /// As with Broyden.
        gate: f64,
    },
    /// A Kalman filter of every error and its slopes, whose slopes change as things move: large motions teach, those in the noise do not,
    /// and errors of a target at rest are averaged.
    #[default]
    Adaptive,
}

/// How far an estimated Jacobian is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// Largest motion in one step, as the length of all quantities together [their unit]. Default 0.5.
    pub motion: f64,
    /// A step is shortened until errors grow by less than half of [`Settings::divergence`], and fall by a part of what they should where that
    /// is much, even if the Jacobian is wrong by this many standard deviations. Default 3.5.
    pub confidence: f64,
    /// Cost of the fourth power of a motion's length, as a share of the slopes' squares: long motions along directions that hardly
    /// show are avoided. Default 0.001.
    pub restraint: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            gain: 0.5,
            exploration: Exploration::default(),
            update: Update::default(),
            curvature: 0.7,
            dither: 1.2,
            trust: Some(Trust::default()),
            divergence: 100.0,
            worst_condition: 3000.0,
        }
    }
}

/// Rows of the thesis's tasks, to which [`Settings::divergence`] refers.
const ROWS: f64 = 12.0;

impl Settings {
    /// For as many rows: the errors of more may grow by more.
    pub(in crate::servo) fn for_rows(&self, rows: usize) -> Settings {
        Settings { divergence: self.divergence * f64::max(1.0, rows as f64 / ROWS), ..self.clone() }
    }

    /// The controller of the thesis, dq = -λ J⁺ e (eq. 2.15), with motions of `size` along every quantity and J kept as explored.
    pub fn plain(gain: f64, size: f64) -> Self {
        Settings {
            gain,
            exploration: Exploration::fixed(size),
            update: Update::Keep,
            dither: 0.0,
            trust: None,
            worst_condition: f64::INFINITY,
            ..Settings::default()
        }
    }

    /// For a model that takes the place of exploring: whole steps, no restraint, and a curvature that is what the model misses of it.
    pub fn with_rig() -> Self {
        Settings {
            gain: 1.0,
            curvature: 0.05,
            divergence: 1000.0,
            trust: Some(Trust { motion: 3.0, restraint: 0.0, ..Trust::default() }),
            ..Settings::default()
        }
    }
}

impl Default for Exploration {
    fn default() -> Self {
        Exploration { size: 0.02, clarity: 30.0, largest: 0.2, directions: Vec::new() }
    }
}

impl Exploration {
    /// Every quantity by the same motion.
    pub fn fixed(size: f64) -> Self {
        Exploration { size, clarity: 0.0, largest: size, directions: Vec::new() }
    }
}

impl Default for Trust {
    fn default() -> Self {
        Trust { motion: 0.5, confidence: 3.5, restraint: 0.001 }
    }
}
