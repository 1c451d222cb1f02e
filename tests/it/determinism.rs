//! The same input gives the same bytes, on any number of threads, and the order of names does not matter.
use crate::learning::{learn, nothing, over_floor, record, variants};
use handeye::calibrate::Calibration;
use handeye::recording::Recording;
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::cmp::Reverse;

/// All that is said, but for how long it took.
fn said(learned: &Calibration) -> String {
    let mut report = learned.report.clone();
    report.stages.iter_mut().for_each(|stage| stage.seconds = 0.0);
    format!("{}\n{report:?}", learned.rig.to_toml())
}

#[test]
fn one_thread_and_two_and_another_run_learn_the_same_bytes() {
    let with = |threads: usize, start: &Rig, recording: &Recording| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| said(&learn(start, recording).unwrap()))
    };
    for (truth, options) in [
        (random_rig(6, 2, 12, 1), SimulateOptions::default()),
        (random_rig(6, 1, 12, 2), SimulateOptions { samples: 60, ..SimulateOptions::default() }),
        (random_rig(7, 3, 12, 3), SimulateOptions { missed: 0.3, outliers: 0.05, ..SimulateOptions::default() }),
        (variants::on_hand(1, 4), SimulateOptions { samples: 60, ..SimulateOptions::default() }),
        (variants::ur5(5), SimulateOptions { samples: 500, ..SimulateOptions::default() }),
    ] {
        let recording = simulate(&truth, &options).unwrap().recording;
        let start = variants::forgotten(&truth);
        let one = with(1, &start, &recording);
        assert_eq!(one, with(2, &start, &recording), "one thread and two");
        assert_eq!(one, with(2, &start, &recording), "another run");
    }
}

/// The same with cameras in reverse order, and features under names that reverse theirs.
fn reversed(recording: &Recording) -> Recording {
    let mut reversed = recording.clone();
    let [cameras, features] = [recording.cameras.len() as u32, recording.features.len() as u32];
    reversed.cameras.reverse();
    for sample in &mut reversed.samples {
        for detection in &mut sample.pixels {
            detection.camera = cameras - 1 - detection.camera;
            detection.feature = features - 1 - detection.feature;
        }
        sample.pixels.sort_by_key(|detection| (detection.camera, detection.feature));
    }
    reversed
}

fn with_features_reversed(truth: &Rig) -> Rig {
    let mut rig = truth.clone();
    let places: Vec<_> = rig.features.iter().map(|feature| feature.xyz).collect();
    rig.features.iter_mut().zip(places.into_iter().rev()).for_each(|(feature, xyz)| feature.xyz = xyz);
    rig
}

#[test]
fn the_order_of_cameras_and_features_does_not_matter() {
    for seed in 0..4 {
        let truth = random_rig(6, 2 + (seed % 2) as usize, 12, seed);
        let recording = record(&truth, 50, seed);
        let one = over_floor(&learn(&nothing(&truth), &recording).unwrap().rig, &truth, seed);
        let other_way = learn(&nothing(&truth), &reversed(&recording)).unwrap().rig;
        // Evaluated with the names that it was learned with.
        let other = over_floor(&with_features_reversed(&other_way), &truth, seed);
        // Both stop where a step changes the loss by less than its tolerance: the same minimum to 1e-4 of the floor.
        assert!((one - other).abs() < 1e-4, "seed {seed}: {one} and {other}");
    }
}

#[test]
fn the_order_of_samples_does_not_matter() {
    for seed in 0..4 {
        let truth = random_rig(6, 2, 12, seed);
        let mut recording = record(&truth, 50, seed);
        let one = over_floor(&learn(&nothing(&truth), &recording).unwrap().rig, &truth, seed);
        let mut order: Vec<usize> = (0..50).collect();
        order.sort_by_key(|&index| Reverse((37 * index) % 50));
        recording.samples = order.into_iter().map(|index| recording.samples[index].clone()).collect();
        let other = over_floor(&learn(&nothing(&truth), &recording).unwrap().rig, &truth, seed);
        assert!((one - other).abs() < 1e-4, "seed {seed}: {one} and {other}");
    }
}
