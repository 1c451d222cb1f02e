//! Poses and joints from pixels, timed: CPU time of a call in the median over 1,000 samples, beside what was published.
//!
//! `cargo bench --bench infer`. Two cameras, 12 features, 0.3 px; *turning* is a UR5 whose joints turn by 2π to either side, so
//! that a sample has up to eight branches.
use cpu_time::ThreadTime;
use handeye::infer::{InferOptions, Inference, Moment, Names, Prior, Sighting};
use handeye::rig::{Rig, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use std::hint::black_box;

const SAMPLES: usize = 1000;

/// Published, with one starting point [µs]: the pose, the joints.
const PUBLISHED: [f64; 2] = [511.0, 102_000.0];

fn main() {
    let mut ur5 = catalog::rig("ur5").expect("shipped");
    ur5.noise.joint_action = 0.01;
    let mut turning = ur5.clone();
    for joint in &mut turning.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (Some(-std::f64::consts::TAU), Some(std::f64::consts::TAU));
    }
    let options = SimulateOptions { samples: SAMPLES, seed: 3, ..SimulateOptions::default() };
    let recording = simulate(&ur5, &options).expect("the rig is complete").recording;
    let names = Names::new(&ur5, &recording);
    let seen: Vec<Vec<Sighting>> = recording.samples.iter().map(|sample| names.sightings(sample)).collect();
    let joints: Vec<Vec<f64>> = recording.samples.iter().map(|sample| sample.joints.clone().expect("read")).collect();
    let inference = |rig: &Rig| Inference::new(rig, InferOptions::default()).expect("the rig is complete");
    let (mut narrow, mut wide) = (inference(&ur5), inference(&turning));

    println!("{:44} median µs  99 % µs  published over it", "");
    let pose = times(|i| drop(black_box(narrow.poses(&seen[i]))));
    row("pose of the tip, all cameras", pose, Some(PUBLISHED[0]));
    let all = times(|i| drop(black_box(narrow.joints(&seen[i], &Prior::none()))));
    row("joints from nothing", all, Some(PUBLISHED[1]));
    let all = times(|i| drop(black_box(wide.joints(&seen[i], &Prior::none()))));
    row("joints from nothing, turning, every branch", all, Some(PUBLISHED[1]));
    let start = |i: usize| Prior::start(&joints[i].iter().map(|joint| joint + 0.02).collect::<Vec<_>>());
    let near = times(|i| drop(black_box(narrow.joints_near(&seen[i], &start(i)))));
    row("joints from 0.02 rad beside", near, None);
    let moment = |i: usize| Moment { sightings: seen[i].clone(), action: recording.samples[i].joint_action.clone() };
    let histories: Vec<[Moment; 2]> = (0..SAMPLES - 1).map(|i| [moment(i), moment(i + 1)]).collect();
    let history = times(|i| drop(black_box(wide.joints_of_history(&histories[i % histories.len()], &Prior::none()))));
    row("joints from two samples, turning", history, None);
}

fn row(what: &str, (median, last): (f64, f64), published: Option<f64>) {
    let ratio = published.map_or(String::new(), |published| format!("{:>12.0}", published / median));
    println!("{what:44} {median:>9.1}  {last:>7.1} {ratio}");
}

/// Median and 99 % of the CPU times of a call [µs].
fn times(mut call: impl FnMut(usize)) -> (f64, f64) {
    let time = |i| {
        let start = ThreadTime::now();
        call(i);
        1e6 * start.elapsed().as_secs_f64()
    };
    let mut all: Vec<f64> = (0..SAMPLES).map(time).collect();
    all.sort_by(f64::total_cmp);
    (all[SAMPLES / 2], all[SAMPLES * 99 / 100])
}
