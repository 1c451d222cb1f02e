//! How far noise of what was read of the robot's state carries predictions from where features are seen.
use super::Correspondence;
use super::observation::Kind;
use super::placed::Placed;
use crate::recording::{Recording, Sample};
use crate::rig::{Model, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Samples that are looked at, spread evenly over the recording.
const SAMPLES: usize = 200;

/// Root mean square distances that the noise of readings alone gives predictions, as a rig states it and to first order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadingNoise {
    /// Of pixels [px].
    pub px: f64,
    /// Of points [m].
    pub m: f64,
}

impl ReadingNoise {
    /// Over all cameras, and per camera of the rig.
    pub(crate) fn new(rig: &Rig, model: &Model, recording: &Recording) -> (Self, Vec<Self>) {
        let index = Correspondence::new(rig, recording);
        let mut squares = vec![[(0.0, 0.0); 2]; rig.cameras.len()];
        let every = recording.samples.len().div_ceil(SAMPLES).max(1);
        for sample in recording.samples.iter().step_by(every) {
            let Some(placed) = Placed::read(model, sample) else { continue };
            let displaced = displaced(rig, model, sample);
            for seen in placed.predictable(model, &index, sample) {
                let predicted = |links: &[Pose]| seen.predicted(model, links);
                let here = predicted(&placed.links);
                let (sum, count) = &mut squares[seen.camera][seen.kind() as usize];
                *sum += displaced.iter().map(|links| (predicted(links) - here).norm_squared()).sum::<f64>();
                *count += 1.0;
            }
        }
        let rms = |of: &dyn Fn(Kind) -> (f64, f64)| {
            let [px, m] = Kind::ALL.map(|kind| (of(kind).0 / of(kind).1.max(1.0)).sqrt());
            ReadingNoise { px, m }
        };
        let cameras = squares.iter().map(|of_camera| rms(&|kind| of_camera[kind as usize])).collect();
        let sum =
            |kind: Kind| squares.iter().map(|of| of[kind as usize]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        (rms(&sum), cameras)
    }
}

/// The links with the reading of every joint off by `sd` [rad or m], one at a time; none where it is exact.
pub(crate) fn by_joint(model: &Model, joints: &[f64], sd: f64) -> Vec<Vec<Pose>> {
    let moved = |joint: usize| {
        let mut joints = joints.to_vec();
        joints[joint] += sd;
        model.links(&joints)
    };
    if sd > 0.0 { (0..joints.len()).map(moved).collect() } else { Vec::new() }
}

/// The links with every number of a sample's reading off by its standard deviation, one at a time.
fn displaced(rig: &Rig, model: &Model, sample: &Sample) -> Vec<Vec<Pose>> {
    let noise = &rig.noise;
    if let Some(joints) = &sample.joints {
        return by_joint(model, joints, noise.joints);
    }
    let Some(pose) = sample.pose.filter(|_| noise.pose.is_noisy()) else { return Vec::new() };
    let moved = |axis: usize| {
        let by = |first: usize, sd: f64| if axis / 3 == first { Vector3::ith(axis % 3, sd) } else { Vector3::zeros() };
        let turned = pose * Pose::new(by(0, noise.pose.rot), Vector3::zeros());
        let translation = turned.translation + by(1, noise.pose.xyz);
        Placed::by_tip(model, Pose { translation, ..turned }).links
    };
    (0..6).map(moved).collect()
}
