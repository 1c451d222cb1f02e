//! Combinations of numbers that the data leave open: in words and numbers, what they cost at the tip, and what would help.
use super::cures::cure;
use super::deviations::{Honest, name};
use super::direction::Direction;
use super::graph::{Built, State};
use super::report::length_in_words;
use super::{gauge, moves};
use handeye_solvers::{Component, WeakDirection, Weakness};
use std::cmp::Ordering;

/// Numbers of a rig that can move together without the data objecting much.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Parameter paths and how far each moves, in its own unit; the largest first and 1.
    pub numbers: Vec<(String, f64)>,
    /// What moves together, in words: the largest parts, and how many smaller ones there are.
    pub moves: String,
    /// What determines it.
    pub determined_by: DeterminedBy,
    /// Standard deviation of the tip's position that comes of it, root mean square over the recorded samples [m, or the
    /// model's unit]; `None` where nothing bounds it.
    pub tip: Option<f64>,
    /// The camera that moves furthest against what it is mounted on, and how far: a standard deviation of its centre [m, or the model's unit].
    /// `None` where no camera moves, or nothing bounds it.
    pub camera: Option<(String, f64)>,
    /// True where lengths are metres.
    pub metric: bool,
    /// What would determine it at the least expense, in words; empty where nothing that can be seen would.
    pub cure: String,
}

/// What determines a combination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeterminedBy {
    /// Nothing.
    Nothing,
    /// A prior more than the data: the standard deviation from the data over that from the priors, infinite where the data
    /// say nothing.
    Prior(f64),
    /// The data, and poorly: the case is ill-posed.
    Poorly {
        /// Standard deviation of the positions and lengths that take part, together [m, or the model's unit].
        sd: f64,
        /// The same as a share of the distance between cameras and features.
        share: f64,
        /// True where it is in metres.
        metric: bool,
    },
}

/// How many times as well, in words.
pub(crate) fn times(ratio: f64) -> String {
    if ratio < 10.0 { format!("{ratio:.1} times") } else { format!("{ratio:.0} times") }
}

/// Combinations that are put in words.
const DIRECTIONS: usize = 6;

/// Less than this is no motion of a camera or the tip [m, or the model's unit].
const STILL: f64 = 5e-5;

/// Combinations of which a cure is looked for.
const CURED: usize = 24;

impl Combination {
    /// Of what nothing, or a prior more than the data, determines.
    pub(crate) fn all(honest: &Honest<'_>, state: &State, built: &Built, found: &[WeakDirection]) -> Vec<Self> {
        let one = |(rank, weak): (usize, &WeakDirection)| {
            let determined_by = match weak.kind {
                Weakness::Open => DeterminedBy::Nothing,
                Weakness::Prior => DeterminedBy::Prior(weak.sd_ratio),
            };
            let direction = Direction::of_weak(honest, built, weak);
            Combination::new(honest, state, built, &direction, determined_by, rank < CURED)
        };
        let mut all: Vec<Combination> = found.iter().enumerate().map(one).collect();
        all.sort_by(|one, other| other.motions().partial_cmp(&one.motions()).unwrap_or(Ordering::Equal));
        all
    }

    pub(crate) fn new(
        honest: &Honest<'_>,
        state: &State,
        built: &Built,
        direction: &Direction,
        determined_by: DeterminedBy,
        is_cured: bool,
    ) -> Self {
        let setup = &honest.setup;
        let samples: Vec<usize> = (0..setup.len()).collect();
        let cameras = direction.camera_motion(state, built).unwrap_or_default().into_iter().zip(&setup.rig.cameras);
        let furthest = cameras.max_by(|one, other| one.0.total_cmp(&other.0)).filter(|(by, _)| *by > STILL);
        let rms = |all: Vec<f64>| (all.iter().map(|x| x * x).sum::<f64>() / all.len().max(1) as f64).sqrt();
        let of_part = |part: &Component| (name(setup, built, part.node, part.coordinate), part.weight);
        let numbers: Vec<(String, f64)> = direction.parts.iter().map(of_part).collect();
        Combination {
            moves: moves::in_words(&setup.rig, &numbers),
            numbers,
            determined_by,
            tip: direction.tip_motion(honest, state, built, &samples).map(rms),
            camera: furthest.map(|(by, camera)| (camera.name.clone(), by)),
            metric: gauge::length_is_known(setup),
            cure: if is_cured { cure(honest, state, built, direction) } else { String::new() },
        }
    }

    /// How far it moves a camera against what it is mounted on, and the tip; infinite where nothing bounds it.
    fn motions(&self) -> [f64; 2] {
        let unbounded = if self.determined_by == DeterminedBy::Nothing { f64::INFINITY } else { 0.0 };
        let tip = self.tip.filter(|tip| *tip > STILL);
        [self.camera.as_ref().map_or(unbounded, |(_, by)| *by), tip.unwrap_or(unbounded)]
    }

    /// What it moves of what a robot is used by, such as "it moves the tip by 2.0 mm, and no camera"; empty where nothing bounds it.
    pub fn matters(&self) -> String {
        let length = |by: f64| length_in_words(by, self.metric);
        let camera = self
            .camera
            .as_ref()
            .map(|(name, by)| format!("camera `{name}` by {} against what it is mounted on", length(*by)));
        let tip = self.tip.filter(|tip| *tip > STILL).map(|tip| format!("the tip by {}", length(tip)));
        match (camera, tip) {
            _ if self.determined_by == DeterminedBy::Nothing => String::new(),
            (Some(camera), Some(tip)) => format!("it moves {camera}, and {tip}"),
            (Some(camera), None) => format!("it moves {camera}, and not the tip"),
            (None, Some(tip)) => format!("it moves {tip}, and no camera against what it is mounted on"),
            (None, None) => "it moves neither a camera against what it is mounted on nor the tip".to_owned(),
        }
    }
}

impl std::fmt::Display for Combination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.determined_by {
            DeterminedBy::Nothing => write!(f, "nothing determines ")?,
            DeterminedBy::Prior(ratio) if ratio > 1e3 => write!(f, "only what is given determines ")?,
            DeterminedBy::Poorly { sd, share, metric } => {
                let length = if metric { format!("{:.1} mm, ", 1e3 * sd) } else { String::new() };
                write!(f, "ill-posed: the data determine only to {length}{:.1} % of the distance ", 1e2 * share)?;
                write!(f, "between cameras and features (one standard deviation) ")?;
            }
            DeterminedBy::Prior(ratio) => {
                write!(f, "what is given determines, {} as well as the data, ", times(ratio))?
            }
        }
        f.write_str(&self.moves)?;
        let matters = self.matters();
        if !matters.is_empty() {
            write!(f, " ({matters})")?;
        }
        if !self.cure.is_empty() {
            write!(f, "; {}", self.cure)?;
        }
        Ok(())
    }
}

/// The first, and how many there are besides: those that move a camera or the tip, and of these those that can be cured.
pub(crate) fn in_words(all: &[Combination]) -> Vec<String> {
    let mut order: Vec<&Combination> = all.iter().collect();
    order.sort_by_key(|one| (one.motions() == [0.0; 2], one.cure.is_empty()));
    let mut words: Vec<String> = order.into_iter().take(DIRECTIONS).map(Combination::to_string).collect();
    if all.len() > DIRECTIONS {
        words.push(format!("and {} combinations more like these", all.len() - DIRECTIONS));
    }
    words
}
