//! Mistakes in a recording are found before it is learned from, and none in a clean one.
#[path = "../../benches/common/faults.rs"]
mod faults;

use faults::Fault;
use handeye::calibrate::Options;
use handeye::doctor::examine;
use handeye::recording::Recording;
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=5;

fn found(rig: &Rig, recording: &Recording) -> Vec<String> {
    let diagnosis = examine(rig, recording, &Options::default());
    diagnosis.findings.into_iter().map(|finding| finding.what).collect()
}

/// Pixels of a random rig, of which nothing is known but the intrinsics, with joints or with tip poses.
fn pixels(seed: u64, by_joints: bool) -> (Rig, Recording) {
    let rig = random_rig(6, 2, 12, seed);
    let simulation = simulate(&rig, &SimulateOptions { seed, ..SimulateOptions::default() }).unwrap();
    let mut recording = simulation.recording;
    if !by_joints {
        recording.joints.clear();
        for (sample, truth) in recording.samples.iter_mut().zip(simulation.truth.samples) {
            (sample.joints, sample.pose) = (None, truth.pose);
        }
    }
    (Rig::default(), recording)
}

fn is_found(fault: &Fault, (mut rig, mut recording): (Rig, Recording), seed: u64) {
    (fault.plant)(&mut rig, &mut recording);
    let found = found(&rig, &recording);
    assert!(found.len() == 1 && found[0].contains(fault.says), "{}, seed {seed}: {found:?}", fault.name);
}

#[test]
fn nothing_is_found_in_clean_recordings() {
    for seed in SEEDS {
        for (rig, recording) in [pixels(seed, true), pixels(seed, false), faults::targets(seed, 30, false)] {
            assert_eq!(found(&rig, &recording), Vec::<String>::new(), "seed {seed}");
        }
    }
}

#[test]
fn every_mistake_of_targets_and_tip_poses_is_found() {
    for fault in faults::of_targets() {
        SEEDS.for_each(|seed| is_found(&fault, faults::targets(seed, 30, false), seed));
    }
}

#[test]
fn rotations_about_one_axis_are_found_with_the_axis() {
    for seed in SEEDS {
        let (rig, recording) = faults::targets(seed, 30, true);
        let found = found(&rig, &recording);
        assert!(found.len() == 1 && found[0].contains("one axis of the tip: ("), "seed {seed}: {found:?}");
    }
}

/// A second joint that moves by a few degrees is no noise: that its turns are few is said, not that there are none.
#[test]
fn few_turns_about_another_axis_are_not_called_none() {
    let rig = random_rig(6, 2, 12, 3);
    let mut recording = simulate(&rig, &SimulateOptions::default()).unwrap().recording;
    let home = recording.samples[0].joints.clone().unwrap();
    let mut told = |first: f64, second: f64| {
        for (index, sample) in recording.samples.iter_mut().enumerate() {
            let (s, c) = (1.7 * index as f64).sin_cos();
            let mut joints = home.clone();
            (joints[1], joints[4]) = (home[1] + first * s, home[4] + second * c);
            (sample.joints, sample.pixels) = (Some(joints), Vec::new());
        }
        found(&rig, &recording)
    };
    let few = told(0.8, 0.04);
    assert!(few.len() == 1 && few[0].contains("nearly about one axis"), "{few:?}");
    let none = told(0.8, 0.002);
    assert!(none.len() == 1 && none[0].contains("all rotations are about one axis of the tip: ("), "{none:?}");
    let hardly = told(0.03, 0.02);
    assert!(hardly.len() == 1 && hardly[0].contains("the tip hardly turns: by "), "{hardly:?}");
    assert!(told(0.8, 0.8).is_empty());
}

/// One test per fault, which takes several calibrations for every seed.
macro_rules! mistakes_of_pixels {
    ($($test:ident: $faults:ident, $fault:literal;)*) => {$(
        #[test]
        fn $test() {
            let by_joints = stringify!($faults) == "of_joints";
            let fault = faults::$faults().into_iter().find(|fault| fault.name == $fault).unwrap();
            SEEDS.for_each(|seed| is_found(&fault, pixels(seed, by_joints), seed));
        }
    )*};
}

mistakes_of_pixels! {
    inverted_tip_poses_are_found: of_tips, "robot inverted";
    quaternions_of_tips_with_w_first_are_found: of_tips, "robot wxyz";
    tips_in_millimetres_are_found: of_tips, "robot mm";
    tip_poses_a_sample_early_are_found: of_tips, "robot a sample early";
    degrees_are_found: of_joints, "degrees";
    joints_a_sample_early_are_found: of_joints, "joints a sample early";
    joints_a_sample_late_are_found: of_joints, "joints a sample late";
    joints_two_samples_early_are_found: of_joints, "joints 2 samples early";
    joints_in_reverse_order_are_found: of_joints, "joints reversed";
    two_swapped_joint_rows_are_found: of_joints, "two rows swapped";
    swapped_image_axes_are_found: of_joints, "u, v swapped";
    swapped_principal_points_are_found: of_joints, "cx, cy swapped";
    cameras_declared_on_the_hand_are_found: of_joints, "declared on the hand";
    repeated_samples_are_found: of_joints, "samples repeat";
    two_swapped_tip_poses_are_found: of_tips, "robot rows swapped";
    a_single_moving_joint_is_found: of_joints, "one joint moves";
}

/// Clock lags of more and of less than a sample period.
#[test]
fn joints_that_are_stamped_late_or_early_are_found_and_nothing_is_in_clean_motion() {
    let (rig, recording) = faults::dense_motion(1);
    assert_eq!(found(&rig, &recording), Vec::<String>::new());
    for fault in faults::of_dense_motion() {
        is_found(&fault, faults::dense_motion(1), 1);
    }
}
