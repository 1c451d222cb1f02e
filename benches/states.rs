//! Noisy and unknown states: how well a rig learned from nothing predicts, beside the fit that is started at the truth, which no
//! estimate can beat but by chance, and beside one that is told more than a recording can tell: the truth, as the mean of a
//! Gaussian prior of 5 mrad and 2 mm on the chain, 3 mm on the features, and 1 cm and 10 mrad on the cameras.
//!
//! `cargo bench --bench states -- [SEEDS]`. Random rigs of 6 joints, 2 cameras and 12 features, and the shipped UR5; 0.3 px.
//! *Table 8*: 100 samples with noisy joint readings; mean pixel distance on 100 samples without any noise, with the noise
//! modelled over that without, in the median. *Actions*: 60 samples, nothing read; pixel rms on 100 samples with pixel noise,
//! given their true states counted from the first sample, over the floor, in the median.
use handeye::calibrate::{Options, calibrate, evaluate};
use handeye::recording::{Recording, Sample};
use handeye::rig::{Noise, PoseNoise, Rig};
use handeye::simulate::{SimulateOptions, Simulation, random_rig, simulate};
use handeye::solvers::Pose;
use std::ops::ControlFlow;

fn main() {
    let seeds = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(20);
    println!("{:28} {:>14} {:>14} {:>14} {:>10}", "", "from nothing", "from the truth", "told the truth", "failed");
    for ur5 in [false, true] {
        let rig =
            |seed| if ur5 { handeye::rig::catalog::rig("ur5").expect("shipped") } else { random_rig(6, 2, 12, seed) };
        let name = if ur5 { "UR5" } else { "random" };
        for sd in [0.01, 0.02, 0.03] {
            row(&format!("{name}, table 8, {sd} rad"), seeds, |seed| table8(rig(seed), sd, seed));
        }
        for (kind, what) in [(Kind::Joint, "joint actions"), (Kind::Pose, "pose actions")] {
            row(&format!("{name}, {what}, 0.01"), seeds, |seed| actions(rig(seed), kind, seed));
        }
    }
}

/// Prints medians over the seeds of the figures from each start, infinite where the first could not be had.
fn row(name: &str, seeds: u64, figures: impl Fn(u64) -> [Option<f64>; STARTS]) {
    let all: Vec<_> = (1..=seeds).map(figures).collect();
    let failed = all.iter().filter(|figures| figures[0].is_none()).count();
    let of = |start: usize| median(all.iter().map(|figures| figures[start].unwrap_or(f64::INFINITY)).collect());
    println!("{name:28} {:14.3} {:14.3} {:14.3} {failed:10}", of(0), of(1), of(2));
}

/// From nothing, from the truth, and told the truth.
const STARTS: usize = 3;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Errors with the noise of joints modelled over errors without it, from each start.
fn table8(mut truth: Rig, sd: f64, seed: u64) -> [Option<f64>; STARTS] {
    truth.noise = Noise { pixels: 0.3, ..Noise::default() };
    let fresh = record(&truth, 100, seed + 1_000).truth;
    truth.noise.joints = sd;
    let recording = record(&truth, 100, seed).recording;
    let exact = Rig { noise: Noise { joints: 0.0, ..truth.noise }, ..truth.clone() };
    let error = |rig: &Rig| learn(rig, &recording).map(|rig| evaluate(&rig, &fresh).expect("complete").total.mean_px);
    let ratio = |start: &dyn Fn(&Rig) -> Rig| Some(error(&start(&truth))? / error(&start(&exact))?);
    [ratio(&nothing), ratio(&from_truth), ratio(&told_truth)]
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Joint,
    Pose,
}

/// Errors over the floor, from each start.
fn actions(mut truth: Rig, kind: Kind, seed: u64) -> [Option<f64>; STARTS] {
    truth.noise = Noise { pixels: 0.3, ..Noise::default() };
    let mut fresh = record(&truth, 100, seed + 1_000);
    match kind {
        Kind::Joint => truth.noise.joint_action = 0.01,
        Kind::Pose => truth.noise.pose_action = PoseNoise { xyz: 0.01, rot: 0.01 },
    }
    let Simulation { mut recording, truth: states, .. } = record(&truth, 60, seed);
    recording.samples.iter_mut().for_each(|sample| (sample.joints, sample.pose) = (None, None));
    let zero = states.samples[0].joints.clone().expect("joints are simulated");
    let back = states.samples[0].pose.expect("poses are simulated").inverse();
    let count_from_first = |sample: &mut Sample, pose: Option<Pose>| match kind {
        Kind::Joint => sample.joints.iter_mut().flatten().zip(&zero).for_each(|(joint, zero)| *joint -= zero),
        Kind::Pose => (sample.joints, sample.pose) = (None, pose.map(|pose| pose * back)),
    };
    for (sample, truth) in fresh.recording.samples.iter_mut().zip(&fresh.truth.samples) {
        count_from_first(sample, truth.pose);
    }
    let floor = 0.3 * 2.0_f64.sqrt();
    let error = |rig: &Rig| {
        learn(rig, &recording).map(|rig| evaluate(&rig, &fresh.recording).expect("complete").total.rms_px / floor)
    };
    let counted = |mut start: Rig| {
        for (joint, zero) in start.robot.joints.iter_mut().zip(&zero) {
            joint.offset = joint.offset.map(|offset| offset + zero);
        }
        if kind == Kind::Pose {
            start.robot = Rig::default().robot;
            let in_first_tip = back.inverse();
            for feature in &mut start.features {
                feature.xyz = feature.xyz.map(|xyz| in_first_tip.transform(&xyz.into()).into());
            }
        }
        start
    };
    [nothing(&truth), counted(from_truth(&truth)), counted(told_truth(&truth))].map(|start| error(&start))
}

fn record(rig: &Rig, samples: usize, seed: u64) -> Simulation {
    simulate(rig, &SimulateOptions { samples, seed, ..SimulateOptions::default() }).expect("the rig is in view")
}

fn learn(rig: &Rig, recording: &Recording) -> Option<Rig> {
    calibrate(rig, recording, &Options::default(), &mut |_| ControlFlow::Continue(())).ok().map(|learned| learned.rig)
}

/// A rig of which only the noise is known.
fn nothing(truth: &Rig) -> Rig {
    Rig { noise: truth.noise, ..Rig::default() }
}

/// The truth as a start that says nothing: under priors so wide that they do not matter.
fn from_truth(truth: &Rig) -> Rig {
    let mut rig = truth.clone();
    for path in ["robot", "cameras.*.pose", "features"] {
        rig.estimate.prior.insert(path.to_owned(), 10.0);
    }
    rig
}

/// The truth as a start that says much: under priors as tight as the calibration of an industrial arm.
fn told_truth(truth: &Rig) -> Rig {
    let mut rig = truth.clone();
    for (path, sd) in [
        ("robot.base", 0.01),
        ("robot.joints.*.offset", 0.005),
        ("robot.joints.*.alpha", 0.005),
        ("robot.joints.*.d", 0.002),
        ("robot.joints.*.a", 0.002),
        ("features", 0.003),
        ("cameras.*.pose", 0.01),
    ] {
        rig.estimate.prior.insert(path.to_owned(), sd);
    }
    rig
}
