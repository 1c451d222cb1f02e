//! What a calibration did and found, and how good it is.
use super::{CameraErrors, Combination, Influence, PointErrors, TargetReport};
use crate::rig::{Camera, Length, Noise, Rig};

/// A learned rig and how it came about.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The rig with every value filled in, and how it was learned in `fit`.
    pub rig: Rig,
    /// How it was learned.
    pub report: Report,
}

/// How a rig was learned.
#[derive(Clone, Debug)]
pub struct Report {
    /// Samples used.
    pub samples: usize,
    /// Detections used.
    pub observations: usize,
    /// Detections left out as wrong.
    pub rejected: usize,
    /// Root mean square, mean and median of the pixel distances [px].
    pub rms_px: f64,
    /// Mean pixel distance [px].
    pub mean_px: f64,
    /// Median pixel distance [px].
    pub median_px: f64,
    /// Of those detections that are points of depth cameras.
    pub points: PointErrors,
    /// The same per camera.
    pub cameras: Vec<CameraErrors>,
    /// What was minimised, in order.
    pub stages: Vec<StageReport>,
    /// True where the last stage reached a minimum.
    pub converged: bool,
    /// What the data cannot determine, in words, and how it was fixed.
    pub gauge: Vec<String>,
    /// Where the robot's state is known from: which readings and actions take part, and how well they are known.
    pub states: Vec<String>,
    /// The noise as it was estimated, where that was asked for; it is the learned rig's.
    pub noise: Option<Noise>,
    /// Samples, images and cameras that do not fit.
    pub findings: Vec<Finding>,
    /// Standard deviation of the tip over the recorded workspace; `None` where the data leave the rig open.
    pub tip: Option<TipDeviation>,
    /// Combinations of numbers that nothing, or a prior more than the data, determines; the weakest first.
    pub weak: Vec<Combination>,
    /// What leaving out each sample would change, where [`Options::influence`](super::Options) asks for it.
    pub influence: Vec<Influence>,
    /// What was learned from targets, where these and not pixels were used; the pixel distances are 0 then.
    pub targets: Option<TargetReport>,
}

/// One stage of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct StageReport {
    /// Its name.
    pub name: String,
    /// Iterations of the minimiser, over all starts.
    pub iterations: usize,
    /// Loss before.
    pub loss_before: f64,
    /// Loss after.
    pub loss_after: f64,
    /// How long it took [s].
    pub seconds: f64,
}

/// Something in the recording that does not fit the rest.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// A camera has no detection in a sample with joints and no given pose; the learned rig is without it.
    UnseenCamera {
        /// Its name.
        camera: String,
    },
    /// All errors together are far larger than the stated noise: the model leaves something out.
    Misfit {
        /// Root mean square error of a coordinate over its stated standard deviation.
        ratio: f64,
        /// Stated standard deviation of a coordinate.
        stated: Distance,
    },
    /// A measured length that the learned rig misses by more than three of its standard deviations.
    MissedLength {
        /// What was measured.
        length: Length,
        /// How long it is in the learned rig [m].
        learned: f64,
    },
    /// Single detections were left out.
    Outliers {
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
    },
    /// The joints of a sample, or the tip pose where poses are what was read, do not lead to what its images show; it was left
    /// out.
    WrongJoints {
        /// Index of the sample, from 0.
        sample: usize,
        /// Its median distance from where the learned rig predicts it.
        off: Distance,
        /// The sample whose images its joints fit, where the two were swapped.
        swapped_with: Option<usize>,
        /// True where tip poses were read and no joints.
        by_pose: bool,
    },
    /// Nothing was read of a sample's state, and its images do not determine it; it was left out.
    UnknownState {
        /// Index of the sample, from 0.
        sample: usize,
    },
    /// An image does not belong to its sample; it was left out.
    WrongImage {
        /// Index of the sample, from 0.
        sample: usize,
        /// The camera's name.
        camera: String,
        /// Its median distance from where the learned rig predicts it; of its points, where those are what is wrong.
        off: Distance,
    },
    /// A camera was not where it was during the whole recording; its images were left out of the fit of all else.
    CameraMoved {
        /// The camera's name.
        camera: String,
        /// Largest median shift of an image from where the learned rig puts it.
        largest: Distance,
        /// The sample of that image, from 0.
        sample: usize,
    },
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Finding::UnseenCamera { camera } => write!(f, "camera `{camera}` saw nothing and was left out"),
            Finding::Misfit { ratio, stated } => write!(
                f,
                "errors are {ratio:.1} times the stated noise of {stated}: the noise is larger, a lens model or a joint's kind \
                 is wrong, or the fit went astray"
            ),
            Finding::MissedLength { length, learned } => write!(
                f,
                "{} was measured as {:.2} mm and is {:.2} mm in the learned rig: one of it and the other known lengths is wrong",
                length.between,
                1e3 * length.length,
                1e3 * learned
            ),
            Finding::Outliers { count, of } => write!(f, "{count} of {of} detections do not fit and were left out"),
            Finding::WrongJoints { sample, off, swapped_with, by_pose } => {
                let (leads, fits) = if *by_pose { ("tip pose does", "it fits") } else { ("joints do", "they fit") };
                write!(f, "sample {sample}: its {leads} not lead to what the cameras saw ({off:.1})")?;
                match swapped_with {
                    Some(other) => write!(
                        f,
                        "; {fits} the images of sample {other}: the two are swapped, and both were left out (nothing has to be mended; to use \
                         them, exchange what was read in them)"
                    ),
                    None => write!(f, "; it was left out"),
                }
            }
            Finding::UnknownState { sample } => {
                write!(
                    f,
                    "sample {sample}: nothing was read of the robot's state, and its images do not determine it; it was left out"
                )
            }
            Finding::WrongImage { sample, camera, off } => {
                write!(
                    f,
                    "sample {sample}: the image of camera `{camera}` belongs to another pose ({off:.1}); it was left out"
                )
            }
            Finding::CameraMoved { camera, largest, sample } => {
                write!(
                    f,
                    "camera `{camera}` moved during the recording: sample {sample} is {largest:.1} off; its images were \
                     left out of the fit of all else"
                )
            }
        }
    }
}

/// A distance in an image, or in space where it is one of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// Of pixels [px].
    Pixels(f64),
    /// Of points [m].
    Metres(f64),
}

/// With its unit; points in mm. A precision is that of the number.
impl std::fmt::Display for Distance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (value, unit) = match self {
            Distance::Pixels(px) => (*px, "px"),
            Distance::Metres(m) => (1e3 * m, "mm"),
        };
        value.fmt(f)?;
        write!(f, " {unit}")
    }
}

/// Standard deviation of the tip's position over the recorded samples, as the data leave it.
///
/// In words it is what follows "the tip's position is known to".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipDeviation {
    /// Median over the samples, root of the trace of the covariance.
    pub median: f64,
    /// Largest over the samples.
    pub largest: f64,
    /// Median of what is left where everything is known that a prior determines more than the data do: what the data alone
    /// answer for.
    pub by_data: f64,
    /// True where it is in metres; false where nothing metric is known and it is in the model's unit.
    pub metric: bool,
}

impl TipDeviation {
    /// True where priors decide a good part of it, so that two figures are needed to tell what is known.
    pub fn hangs_on_priors(&self) -> bool {
        self.by_data < 0.9 * self.median
    }

    /// A length of the tip with its unit.
    pub fn length(&self, length: f64) -> String {
        if self.metric { format!("{:.3} mm", 1e3 * length) } else { format!("{length:.2e}") }
    }
}

impl std::fmt::Display for TipDeviation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median, largest, by_data] = [self.median, self.largest, self.by_data].map(|length| self.length(length));
        if self.hangs_on_priors() {
            write!(f, "{by_data} by the data, and to {median} (largest {largest}) with what only priors determine")?;
            write!(f, " (median standard deviations over the samples")?;
        } else {
            write!(f, "{median} (median standard deviation over the samples; largest {largest}")?;
        }
        write!(f, "{})", if self.metric { "" } else { "; nothing metric is known, so in the model's unit" })?;
        if self.hangs_on_priors() {
            write!(f, "; they differ because what pixels do not tell, above all the scale, comes only from what was ")?;
            write!(f, "assumed of the rig")?;
        }
        Ok(())
    }
}

/// How well the pose of every camera is known, with what priors say of it, in words; nothing of those whose poses are held or left open.
pub fn camera_deviations(learned: &Rig) -> Vec<String> {
    let of_camera = |camera: &Camera| {
        let sd = learned.fit.as_ref()?.sd.get(&format!("cameras.{}.pose", camera.name))?;
        let [x, y, z, turns @ ..] = sd.as_slice() else { return None };
        let turn = turns.iter().map(|sd| sd * sd).sum::<f64>().sqrt();
        let [mm, deg] = [1e3 * (x * x + y * y + z * z).sqrt(), turn.to_degrees()];
        Some(format!(
            "the pose of camera `{}` is known to {mm:.3} mm and {deg:.3}° (standard deviation, with the priors)",
            camera.name
        ))
    };
    learned.cameras.iter().filter_map(of_camera).collect()
}
