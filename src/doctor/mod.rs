//! Looks for mistakes in a recording before it is learned from: each as an alternative, scored against the data as recorded.
mod alternatives;
mod data;
mod images;
mod lag;
mod pixels;
mod poses;
mod thin;
mod undo;

pub(crate) use data::repeats;

use crate::calibrate::{self, CLEARLY_BETTER, Distance};
use crate::chain::JointKind;
use crate::recording::Recording;
use crate::rig::{Model, Noise, Rig};
use handeye_solvers::Pose;

/// Up to so many times what noise alone would leave, noise explains a misfit; beyond, it is a mistake or a rig that is not this one.
const EXPLAINED: f64 = 1.7;

/// Median of the length of three errors of standard deviation 1.
const MEDIAN_IN_SPACE: f64 = 1.538;

/// A turn [rad] and a shift [m] that weigh the same.
const TURN: f64 = 0.01;
const SHIFT: f64 = 0.005;

/// How far a hypothesis is from the data, in the median of all detections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// Distance of detections from where the rig learned under the hypothesis predicts them [px].
    Pixels(f64),
    /// Distance of depth cameras' points likewise [m], where nothing else was seen.
    Points(f64),
    /// Disagreement of the robot's and the target's motions.
    Poses {
        /// Angle [rad].
        turn: f64,
        /// Distance [m].
        shift: f64,
    },
}

impl From<Distance> for Misfit {
    fn from(distance: Distance) -> Self {
        match distance {
            Distance::Pixels(px) => Misfit::Pixels(px),
            Distance::Metres(m) => Misfit::Points(m),
        }
    }
}

/// One hypothesis of how the data came about and how well it explains them.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The hypothesis, in words.
    pub alternative: String,
    /// Its misfit; `None` where nothing could be learned under it.
    pub misfit: Option<Misfit>,
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// Units of joints, poses or points.
    Units,
    /// Readings beyond the rig's limits.
    Limits,
    /// Joints that move too little, and turns of the tip that are all about one axis.
    Turns,
    /// How rows go with images and with one another, and how poses, pixels and cameras are written.
    Order,
    /// Which reading is of which joint.
    Joints,
}

/// A mistake in the data, or something that they lack.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What it is about.
    pub about: About,
    /// What is wrong.
    pub what: String,
    /// What to change.
    pub change: String,
}

/// What was found, and the scores that say so; the first is of the data as recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagnosis {
    /// One per hypothesis that was tested.
    pub scores: Vec<Score>,
    /// Empty where nothing is wrong.
    pub findings: Vec<Finding>,
    /// Why nothing could be learned from the data as recorded, where that is so.
    pub unsolved: Option<String>,
    /// The rig's `[noise]`, with what noise of the readings adds to pixels and points: what a misfit is held against.
    pub noise: Noise,
    /// How many samples calibrations looked at, where that is not all: a long recording is thinned, evenly.
    pub thinned_to: Option<usize>,
}

/// What a search is doing: the hypothesis, and how far its calibration is.
pub type Watch<'a> = dyn FnMut(&str, &calibrate::Progress<'_>) + 'a;

/// Examines a recording: order and limits of joints, units, inverted poses, orders of quaternions, pairing of rows and images, time lag, image axes,
/// principal points, the side of the robot that cameras are on, repeated samples, rotations that are all about one axis.
///
/// Targets and tip poses are compared in closed form. Pixels and points take a whole calibration per alternative, most of them only where
/// the data as recorded are not explained to about their noise. They look at about a hundred samples, spread evenly; a lag is looked for in those in
/// which the robot is fastest, also where the data fit otherwise. Never fails: what could not be done is in the diagnosis.
pub fn examine(rig: &Rig, recording: &Recording, options: &calibrate::Options) -> Diagnosis {
    examine_watched(rig, recording, options, &mut |_, _| ())
}

/// The same where each step of its calibrations is told.
pub fn examine_watched(
    rig: &Rig,
    recording: &Recording,
    options: &calibrate::Options,
    watch: &mut Watch<'_>,
) -> Diagnosis {
    if let Some(finding) = data::another_order(rig, recording) {
        return Diagnosis { findings: vec![finding], noise: rig.noise, ..Diagnosis::default() };
    }
    let tips = tips(rig, recording, f64::to_owned);
    let findings = data::findings(rig, recording, &tips);
    let mut diagnosis = Diagnosis { findings, noise: rig.noise, ..Diagnosis::default() };
    let turns_freely = data::one_axis(&tips).is_none();
    if let Some(pairs) = poses::Pairs::new(rig, recording, &tips).filter(|_| turns_freely) {
        let has_poses = recording.samples.iter().any(|sample| sample.pose.is_some());
        let other_tips = if has_poses { Vec::new() } else { other_tips(rig, recording) };
        pairs.examine(&other_tips, &mut diagnosis.scores, &mut diagnosis.findings);
    }
    let is_seen = |sample: &crate::recording::Sample| !sample.pixels.is_empty() || !sample.points.is_empty();
    let is_read = |sample: &crate::recording::Sample| sample.joints.is_some() || sample.pose.is_some();
    if recording.samples.iter().any(|sample| is_seen(sample) && is_read(sample)) {
        pixels::examine(rig, recording, options, &mut diagnosis, watch);
    }
    // Readings in a wrong unit, or of another joint, are outside of limits too.
    if diagnosis.findings.iter().any(|finding| matches!(finding.about, About::Units | About::Joints)) {
        diagnosis.findings.retain(|finding| finding.about != About::Limits);
    }
    let mut known: Vec<Finding> = Vec::new();
    for finding in std::mem::take(&mut diagnosis.findings) {
        if !known.iter().any(|known| known.what == finding.what) {
            known.push(finding);
        }
    }
    diagnosis.findings = known;
    diagnosis
}

/// `world_from_tip` of every sample: as recorded, or by the joints of a chain that is known.
///
/// `angle` makes radians of the reading of a revolute joint.
fn tips(rig: &Rig, recording: &Recording, angle: impl Fn(&f64) -> f64) -> Vec<Option<Pose>> {
    let model = arm(rig, recording);
    let by_joints = |joints: &Vec<f64>| {
        let kinds = rig.robot.joints.iter().map(|joint| joint.kind);
        let read = |(reading, kind)| if kind == JointKind::Revolute { angle(reading) } else { *reading };
        model.as_ref().map(|model| model.tip(&joints.iter().zip(kinds).map(read).collect::<Vec<f64>>()))
    };
    recording.samples.iter().map(|sample| sample.pose.or_else(|| by_joints(sample.joints.as_ref()?))).collect()
}

/// The rig's chain, where it gives one of as many joints as were recorded.
fn arm(rig: &Rig, recording: &Recording) -> Option<Model> {
    let arm = Rig { cameras: Vec::new(), features: Vec::new(), targets: Vec::new(), ..rig.clone() };
    let n_joints = recording.joints.len();
    Model::new(&arm).ok().filter(|model| n_joints > 0 && model.chain.len() == n_joints)
}

/// A reading of joints: what it is about, how it is called, what to change, and the tips that it leads to.
type OtherTips = (About, String, String, Vec<Option<Pose>>);

/// Readings of the joints of a chain that is known beside the one that was recorded.
fn other_tips(rig: &Rig, recording: &Recording) -> Vec<OtherTips> {
    let (name, change) = alternatives::DEGREES;
    let in_degrees = tips(rig, recording, |reading| reading.to_radians());
    let orders = undo::joint_orders(rig, recording).into_iter().map(|(name, change, order)| {
        let tips = tips(rig, &undo::reordered(recording, &order), f64::to_owned);
        (About::Joints, name, change, tips)
    });
    [(About::Units, name.to_owned(), change.to_owned(), in_degrees)].into_iter().chain(orders).collect()
}

/// True where the misfit is far below that of the data as recorded, or where only it could be had.
fn is_clearly_better(misfit: Option<Misfit>, as_recorded: Option<Misfit>) -> bool {
    let limit = as_recorded.map_or(f64::INFINITY, |recorded| CLEARLY_BETTER * recorded.size());
    misfit.is_some_and(|misfit| misfit.size() < limit)
}

impl Misfit {
    /// Its size in relation to what the rig's `[noise]` alone would leave; `None` where that is not stated.
    pub fn over_noise(&self, noise: &Noise) -> Option<f64> {
        let ratio = self.size() / self.of_noise(noise)?.size();
        ratio.is_finite().then_some(ratio)
    }

    /// True where the rig's `[noise]` explains it; never where that is not stated.
    pub fn is_explained(&self, noise: &Noise) -> bool {
        self.of_noise(noise).is_some_and(|left| self.size() <= EXPLAINED * left.size())
    }

    /// What noise alone would leave of the same kind; `None` where that is not stated. The median distance of Gaussian errors is σ √(2 ln 2) in
    /// the image and 1.538 σ in space.
    pub fn of_noise(&self, noise: &Noise) -> Option<Misfit> {
        match self {
            Misfit::Pixels(_) => Some(Misfit::Pixels(noise.pixels * (2.0 * std::f64::consts::LN_2).sqrt())),
            Misfit::Points(_) => Some(Misfit::Points(noise.points * MEDIAN_IN_SPACE)),
            Misfit::Poses { .. } => None,
        }
    }

    /// Pixels, metres, or turn and shift weighed against each other: comparable among misfits of one kind.
    fn size(&self) -> f64 {
        match self {
            Misfit::Pixels(px) => *px,
            Misfit::Points(m) => *m,
            Misfit::Poses { turn, shift } => (turn / TURN).hypot(shift / SHIFT),
        }
    }

    fn turn(&self) -> f64 {
        if let Misfit::Poses { turn, .. } = self { *turn } else { 0.0 }
    }

    fn shift(&self) -> f64 {
        if let Misfit::Poses { shift, .. } = self { *shift } else { 0.0 }
    }
}

impl std::fmt::Display for Misfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Misfit::Pixels(px) => write!(f, "{px:.3} px"),
            Misfit::Points(m) => write!(f, "{:.3} mm", 1e3 * m),
            Misfit::Poses { turn, shift } => write!(f, "{:.2}°, {:.2} mm", turn.to_degrees(), 1e3 * shift),
        }
    }
}
