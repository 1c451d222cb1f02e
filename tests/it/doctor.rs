//! Mistakes in a recording are found before it is learned from, and none in a clean one.
use handeye::calibrate::Options;
use handeye::doctor::examine;
use handeye::recording::Recording;
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};

/// What is found in three recordings of random rigs, spoilt in one way.
fn found(spoil: impl Fn(&mut Recording)) -> Vec<Vec<String>> {
    let find = |seed| {
        let rig = random_rig(6, 2, 12, seed);
        let mut recording = simulate(&rig, &SimulateOptions { seed, ..SimulateOptions::default() }).unwrap().recording;
        spoil(&mut recording);
        let diagnosis = examine(&Rig::default(), &recording, &Options::default());
        diagnosis.findings.into_iter().map(|finding| finding.what).collect()
    };
    (1..=3).map(find).collect()
}

#[test]
fn nothing_is_found_in_clean_recordings() {
    assert_eq!(found(|_| ()), vec![Vec::<String>::new(); 3]);
}

#[test]
fn degrees_are_found() {
    let spoil = |recording: &mut Recording| {
        let joints = recording.samples.iter_mut().filter_map(|sample| sample.joints.as_mut()).flatten();
        joints.for_each(|joint| *joint = joint.to_degrees());
    };
    assert_eq!(found(spoil), vec![vec!["joints are in degrees"]; 3]);
}

#[test]
fn two_swapped_joint_rows_are_found() {
    let spoil = |recording: &mut Recording| {
        let joints = recording.samples[4].joints.clone();
        recording.samples[4].joints = recording.samples[9].joints.clone();
        recording.samples[9].joints = joints;
    };
    assert_eq!(found(spoil), vec![vec!["the joint rows of samples 4 and 9 are swapped"]; 3]);
}

#[test]
fn joints_that_are_a_sample_off_are_found() {
    let spoil = |recording: &mut Recording| {
        let mut joints: Vec<_> = recording.samples.iter().map(|sample| sample.joints.clone()).collect();
        joints.rotate_left(1);
        recording.samples.iter_mut().zip(joints).for_each(|(sample, joints)| sample.joints = joints);
    };
    assert_eq!(found(spoil), vec![vec!["joints are one sample early"]; 3]);
}
