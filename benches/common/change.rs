//! Rigs of which one part moves while a monitor watches.
use handeye::calibrate::{Options, calibrate, evaluate};
use handeye::online::{Cause, Event, Monitor, MonitorOptions};
use handeye::recording::Recording;
use handeye::rig::{Model, Noise, Rig};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use handeye::solvers::nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::ops::ControlFlow;

/// What may move.
pub const KINDS: [Cause; 9] = [
    Cause::Camera(0),
    Cause::Structure,
    Cause::Base,
    Cause::Joint(0),
    Cause::Joint(1),
    Cause::Joint(2),
    Cause::Joint(3),
    Cause::Joint(4),
    Cause::Joint(5),
];

/// Unchanged samples before the change.
const BEFORE: usize = 50;

/// How far pixels shift, in the median [px].
const SHIFT: f64 = 5.0;

/// The truth, and what was learned of it from 50 samples.
pub struct Rigs {
    pub truth: Rig,
    pub learned: Rig,
}

/// What a monitor made of a change.
#[derive(Debug)]
pub struct Look {
    /// Samples until the alarm, the first changed one being 1; `None` without an alarm, or with a false one.
    pub delay: Option<usize>,
    /// Whether the alarm named the cause.
    pub named: bool,
    /// Whether what was relearned is the cause.
    pub relearned: bool,
    /// Pixel rms of the rig after relearning over that of the true one, on fresh samples; infinite where nothing was relearned.
    pub factor: f64,
}

/// A random rig and what is learned of it from nothing; `None` where nothing is.
pub fn learned(seed: u64) -> Option<Rigs> {
    let mut truth = random_rig(6, 2, 12, seed);
    truth.noise = Noise { pixels: 0.3, ..Noise::default() };
    let nothing = Rig { noise: truth.noise, ..Rig::default() };
    let recording = record(&truth, 50, seed);
    let learned = calibrate(&nothing, &recording, &Options::default(), &mut |_| ControlFlow::Continue(())).ok()?;
    let fits = evaluate(&learned.rig, &record(&truth, 50, seed + 3_000)).ok()?.total.rms_px < 1.0;
    fits.then_some(Rigs { truth, learned: learned.rig })
}

/// Alarms and followed drifts in samples of an unchanged rig.
pub fn unchanged(seed: u64, rigs: &Rigs, samples: usize) -> (usize, usize) {
    let recording = record(&rigs.truth, samples, seed + 1_000);
    let mut monitor = Monitor::new(&rigs.learned, &recording, MonitorOptions::default()).expect("complete");
    let events: Vec<Event> = recording.samples.iter().map(|sample| monitor.observe(sample)).collect();
    let count = |pick: fn(&Event) -> bool| events.iter().filter(|event| pick(event)).count();
    (count(|event| matches!(event, Event::Changed(_))), count(|event| matches!(event, Event::Followed { .. })))
}

/// Moves a part after some samples, and looks on.
pub fn look(seed: u64, rigs: &Rigs, kind: Cause) -> Look {
    let moved = shifted(&rigs.truth, &kind, seed);
    let before = record(&rigs.truth, BEFORE, seed + 1_000);
    let after = record(&moved, 12, seed + 2_000);
    let mut monitor = Monitor::new(&rigs.learned, &before, MonitorOptions::default()).expect("complete");
    let mut look = Look { delay: None, named: false, relearned: false, factor: f64::INFINITY };
    let early = before.samples.iter().any(|sample| matches!(monitor.observe(sample), Event::Changed(_)));
    for (number, sample) in after.samples.iter().enumerate() {
        match monitor.observe(sample) {
            Event::Changed(change) if look.delay.is_none() && !early => {
                look.delay = Some(number + 1);
                look.named = change.cause == kind;
            }
            Event::Relearned { cause, .. } => {
                look.relearned = cause == kind;
                let fresh = record(&moved, 50, seed + 4_000);
                let rms = |rig: &Rig| evaluate(rig, &fresh).expect("complete").total.rms_px;
                look.factor = rms(monitor.rig()) / rms(&moved);
                break;
            }
            _ => {}
        }
    }
    look
}

/// The rig with a part moved in a random direction, as far as shifts the pixels that depend on it by [`SHIFT`] in the median.
fn shifted(truth: &Rig, kind: &Cause, seed: u64) -> Rig {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut vector = |sd: f64| Vector3::from_fn(|_, _| sd * random.sample::<f64, _>(StandardNormal));
    let (turn, shift) = (vector(0.01), vector(0.01));
    let poses = simulate(truth, &SimulateOptions { samples: 50, seed: seed + 5_000, ..SimulateOptions::default() });
    let poses = poses.expect("in view").truth;
    let mut size = 1.0;
    for _ in 0..20 {
        let moved = at(truth, kind, size, turn, shift);
        size *= SHIFT / median_shift(truth, &moved, kind, &poses).clamp(1e-9, 1e9);
    }
    at(truth, kind, size, turn, shift)
}

fn at(truth: &Rig, kind: &Cause, size: f64, turn: Vector3<f64>, shift: Vector3<f64>) -> Rig {
    let mut rig = truth.clone();
    let motion = Pose::new(turn * size, shift * size);
    match *kind {
        Cause::Camera(camera) => rig.cameras[camera].pose = rig.cameras[camera].pose.map(|pose| pose * motion),
        Cause::Structure => {
            let features = rig.features.iter_mut().flat_map(|feature| &mut feature.xyz);
            features.for_each(|xyz| *xyz = motion.transform(&Vector3::from(*xyz)).into());
        }
        Cause::Base => rig.robot.base = Some(rig.robot.base.unwrap_or_else(Pose::identity) * motion),
        Cause::Joint(joint) => {
            rig.robot.joints[joint].offset = rig.robot.joints[joint].offset.map(|offset| offset + 0.01 * size);
        }
        Cause::Unexplained => {}
    }
    rig
}

fn median_shift(truth: &Rig, moved: &Rig, kind: &Cause, poses: &Recording) -> f64 {
    let (before, after) = (Model::new(truth).expect("complete"), Model::new(moved).expect("complete"));
    let mut shifts = Vec::new();
    for sample in &poses.samples {
        let joints = sample.joints.as_ref().expect("joints are simulated");
        let (old, new) = (before.links(joints), after.links(joints));
        for seen in &sample.pixels {
            let (camera, feature) = (seen.camera as usize, seen.feature as usize);
            if !matches!(kind, Cause::Camera(moved) if *moved != camera) {
                let ([a, b], [c, d]) = (before.pixel(camera, feature, &old), after.pixel(camera, feature, &new));
                shifts.push((a - c).hypot(b - d));
            }
        }
    }
    shifts.sort_by(f64::total_cmp);
    shifts[shifts.len() / 2]
}

/// A recording of random motions.
pub fn record(rig: &Rig, samples: usize, seed: u64) -> Recording {
    let options = SimulateOptions { samples, seed, ..SimulateOptions::default() };
    simulate(rig, &options).expect("the rig is in view").recording
}
