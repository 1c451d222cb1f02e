//! Scenes that experiments are made of.
use crate::Error;
use crate::experiments::Row;
use crate::geometry::looking_at;
use crate::rig::{Camera, Parent, Rig};
use crate::scene::{Control, Moment, Run, Scene, Target, UncalibratedControl, run};
use crate::servo::image_tasks::{Feature, ImageTask, Kind, Part, Place, PointToPoint, Trackers};
use crate::servo::{LoopSettings, Takes};
use crate::simulate::world::WorldOptions;
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;

/// Where the joints of the UR5 shall be [rad].
pub(super) const UR5_TARGET: [f64; 6] = [0.0, -1.3, 1.2, -1.5, -1.6, 0.3];

/// Points of its hand in the tip's frame, which shall meet as many of a target [m].
pub(super) const UR5_POINTS: [[f64; 3]; 4] =
    [[0.08, 0.0, 0.05], [-0.06, 0.06, 0.06], [-0.05, -0.07, 0.08], [0.0, 0.02, 0.15]];

/// A scene of a rig whose arm shall be where the task is solved with these joints.
pub(super) fn scene(rig: Rig, task: ImageTask, start: Vec<f64>, target: Vec<f64>, seed: u64) -> Scene {
    Scene { task: Some(task), ..scene_of_features(rig, start, target, seed) }
}

/// A scene of a rig whose features shall be seen where they are with these joints: a robot that takes joint motions and errs in nothing,
/// exact trackers, an uncalibrated controller with its defaults.
pub(super) fn scene_of_features(rig: Rig, start: Vec<f64>, target: Vec<f64>, seed: u64) -> Scene {
    Scene {
        name: None,
        rig: Some(rig),
        world: WorldOptions { seed, ..WorldOptions::default() },
        faults: Vec::new(),
        slips: Vec::new(),
        couplings: Vec::new(),
        task: None,
        takes: Takes::JointDelta,
        start,
        target: Target { joints: target, until: f64::INFINITY, ..Target::default() },
        control: Some(Control::Uncalibrated(UncalibratedControl::default())),
        limits: Vec::new(),
        settings: LoopSettings::default(),
        dt: 1.0,
        files: Vec::new(),
    }
}

/// A loop that goes on for so many steps, whatever happens, unless the controller gives up.
pub(super) fn endless(steps: usize) -> LoopSettings {
    LoopSettings { timeout: steps as f64, follow: true, diverged: f64::INFINITY, ..LoopSettings::default() }
}

/// Runs a scene to its end.
pub(super) fn go(scene: &Scene) -> Result<Run, Error> {
    run(None, scene, &mut |_| ControlFlow::Continue(()))
}

/// Points of the hand, given in the tip's frame [m], on as many of a target, in the images of these cameras.
pub(super) fn meeting(cameras: &[&str], points: &[[f64; 3]], trackers: Trackers) -> Result<ImageTask, Error> {
    let (features, pairs) = pairs(points);
    let part = |[point, to]: [usize; 2]| Part {
        kind: Kind::PointToPoint(PointToPoint { point, to }),
        cameras: (0..cameras.len()).collect(),
    };
    let names = cameras.iter().map(|name| (*name).to_owned()).collect();
    ImageTask::new(None, names, features, pairs.into_iter().map(part).collect(), trackers)
}

/// Points of the hand, as many of the target, and which shall meet which.
pub(super) fn pairs(points: &[[f64; 3]]) -> (Vec<Feature>, Vec<[usize; 2]>) {
    let feature = |name: String, place| Feature { name, place };
    let of_hand = |(i, xyz): (usize, &[f64; 3])| feature(format!("hand-{i}"), Place::Hand(Some((*xyz).into())));
    let of_target = |(i, xyz): (usize, &[f64; 3])| feature(format!("target-{i}"), Place::Target(Some((*xyz).into())));
    let hand = points.iter().enumerate().map(of_hand);
    let features = hand.chain(points.iter().enumerate().map(of_target)).collect();
    (features, (0..points.len()).map(|i| [i, points.len() + i]).collect())
}

/// Joints near others, each off by up to `most` [rad or m].
pub(super) fn near(joints: &[f64], most: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    joints.iter().map(|joint| joint + random.random_range(-most..most)).collect()
}

/// A pinhole camera; the principal point is the middle of its image.
pub(super) fn camera(name: &str, parent: Parent, pose: Pose, focal: f64, size: [u32; 2]) -> Camera {
    let middle = size.map(|pixels| Some(0.5 * f64::from(pixels) - 0.5));
    Camera {
        name: name.to_owned(),
        size: Some(size),
        fx: Some(focal),
        fy: Some(focal),
        cx: middle[0],
        cy: middle[1],
        parent,
        pose: Some(pose),
        ..Camera::default()
    }
}

/// `world_from_camera` of a camera that looks at a place [m], its images upright where `down` points down.
///
/// Errors: [`Error::Unusable`] where it would look at itself, or along `down`.
pub(super) fn view(from: &Vector3<f64>, at: &Vector3<f64>, down: &Vector3<f64>) -> Result<Pose, Error> {
    looking_at(from, at, down)
        .ok_or_else(|| Error::Unusable("a camera cannot look at itself, or straight down".to_owned()))
}

/// One row for every few commands, of runs that count where they ended from then on.
pub(super) fn against_command(
    panel: &'static str,
    series: &'static str,
    runs: &[Run],
    shown: (usize, usize),
    figure: impl Fn(&Moment) -> Option<f64>,
) -> Vec<Row> {
    let runs: Vec<Vec<Option<f64>>> = runs.iter().map(|run| run.moments.iter().map(&figure).collect()).collect();
    curve(panel, series, &runs, shown)
}

/// The same of figures after every command, by trial. `shown`: how many commands, and every how many.
pub(super) fn curve(
    panel: &'static str,
    series: &'static str,
    trials: &[Vec<Option<f64>>],
    (commands, stride): (usize, usize),
) -> Vec<Row> {
    let row = |command: usize| {
        let at = |trial: &Vec<Option<f64>>| trial.get(command).or(trial.last()).copied().flatten();
        let values: Vec<Option<f64>> = trials.iter().map(at).collect();
        let label = format!("{panel}, {series}, after {command}");
        Row::new(label, None, &values).at(series, command as f64).on(panel)
    };
    (0..=commands).step_by(stride).map(row).collect()
}

/// How runs ended, in words.
pub(super) fn ends(runs: &[Run]) -> String {
    let mut names: Vec<&str> = runs.iter().map(|run| run.stop.name()).collect();
    names.sort_unstable();
    let mut counted: Vec<(&str, usize)> = Vec::new();
    for name in names {
        match counted.last_mut() {
            Some((last, count)) if *last == name => *count += 1,
            _ => counted.push((name, 1)),
        }
    }
    counted.iter().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>().join(", ")
}
