//! Mistakes in a recording are found before it is learned from, and none in a clean one.
#[path = "../../benches/common/faults.rs"]
mod faults;

use crate::cli::Folder;
use faults::Fault;
use handeye::calibrate::Options;
use handeye::doctor::{examine, examine_watched};
use handeye::recording::{Recording, TargetDetection};
use handeye::rig::{Limits, Model, Rig, catalog};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use nalgebra::Vector3;

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
    let mut rig = random_rig(6, 2, 12, 3);
    let mut recording = simulate(&rig, &SimulateOptions::default()).unwrap().recording;
    // What turns beyond its range is another finding.
    rig.robot.joints.iter_mut().for_each(|joint| joint.limits = Limits::default());
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

/// Another robot's limits: how many readings are beyond them is counted here too.
#[test]
fn readings_outside_the_limits_of_the_rig_are_found_first() {
    let mut rig = catalog::rig("ur5").unwrap();
    let recording = simulate(&rig, &SimulateOptions { samples: 20, ..SimulateOptions::default() }).unwrap().recording;
    assert!(!found(&rig, &recording).iter().any(|what| what.contains("limits")));
    let mut read: Vec<f64> = recording.samples.iter().map(|sample| sample.joints.as_ref().unwrap()[2]).collect();
    read.sort_by(f64::total_cmp);
    // Between two readings, further from both than readings are noisy.
    let upper =
        (3..17).map(|k| 0.5 * (read[k] + read[k + 1])).find(|middle| read.iter().all(|r| (r - middle).abs() > 0.02));
    rig.robot.joints[2].limits.upper = upper;
    let beyond = read.iter().filter(|reading| **reading > upper.unwrap()).count();
    let name = rig.robot.joints[2].name.clone();
    let expected = format!("{beyond} of 20 readings of joint `{name}` are outside the rig's limits");
    let found = found(&rig, &recording);
    assert!(found.len() == 1 && found[0].starts_with(&expected), "{expected}: {found:?}");
}

/// As drivers have them that write joints by the alphabet, under names that are not the rig's and under those that are.
#[test]
fn joints_in_other_orders_are_found_with_what_puts_them_right_and_none_are_in_clean_or_noisier_recordings() {
    for seed in 1..=2 {
        assert_eq!(found(&faults::ur5(seed).0, &faults::ur5(seed).1), Vec::<String>::new(), "seed {seed}");
        faults::of_ur_arms().iter().for_each(|fault| is_found(fault, faults::ur5(seed), seed));
    }
    let (mut rig, mut recording) = faults::ur5(3);
    rig.noise.pixels /= 10.0;
    let noisy = examine(&rig, &recording, &Options::default());
    let tried = noisy.scores.iter().filter(|score| score.alternative.ends_with("are swapped")).count();
    assert_eq!((noisy.findings.len(), tried), (0, 15), "{noisy:?}");
    rig.noise.pixels *= 10.0;
    (faults::of_ur_arms()[0].plant)(&mut rig, &mut recording);
    let change = |recording: &Recording| {
        let mut findings = examine(&rig, recording, &Options::default()).findings;
        assert_eq!(findings.len(), 1, "{findings:?}");
        findings.remove(0).change
    };
    let called_so = change(&recording);
    assert!(
        called_so.starts_with("what is called elbow is shoulder_pan, shoulder_pan is elbow: exchange"),
        "{called_so}"
    );
    recording.joints = ["e", "l", "p", "w1", "w2", "w3"].map(str::to_owned).to_vec();
    let otherwise = change(&recording);
    assert!(otherwise.ends_with(": --joints p,l,e,w1,w2,w3 reads them so"), "{otherwise}");
}

/// Three joints in a ring are in none of the orders that are tried: a wrong cure would be worse than none, though some fit less badly and nothing
/// is learned from the data as recorded.
#[test]
fn an_order_of_joints_that_is_not_tried_is_not_taken_for_one_that_is() {
    for seed in 1..=3 {
        let (rig, mut recording) = faults::ur5(seed);
        let readings = recording.samples.iter_mut().flat_map(|sample| &mut sample.joints);
        readings.for_each(|joints| joints[..3].rotate_left(1));
        let found = found(&rig, &recording);
        assert!(found.iter().all(|what| what.contains("outside the rig's limits")), "seed {seed}: {found:?}");
    }
}

/// A camera in the world that sees a target on the tip, which tells in closed form where the tip is.
#[test]
fn two_joints_in_each_other_s_place_are_found_by_poses_of_targets() {
    for seed in SEEDS {
        let (mut rig, mut recording) = faults::ur5(seed);
        let model = Model::new(&rig).unwrap();
        let [camera_from_world, tip_from_target] =
            [[0.3, -0.2, 0.9], [0.05, 0.02, 0.1]].map(|xyz| Pose::new(Vector3::new(2.1, 0.4, -0.3), xyz.into()));
        recording.features.clear();
        for (index, sample) in recording.samples.iter_mut().enumerate() {
            let [s, c] = [(97.0 * index as f64).sin(), (131.0 * index as f64).cos()];
            let noise = Pose::new(1e-3 * Vector3::new(s, c, s * c), 5e-4 * Vector3::new(c, s * c, s));
            let pose = camera_from_world * model.tip(sample.joints.as_ref().unwrap()) * tip_from_target * noise;
            sample.pixels.clear();
            sample.targets = vec![TargetDetection { camera: 0, target: "tag".into(), pose, covariance: None }];
        }
        assert_eq!(found(&rig, &recording), Vec::<String>::new(), "seed {seed}");
        for fault in faults::of_ur_arms() {
            is_found(&fault, (rig.clone(), recording.clone()), seed);
        }
        rig.robot.joints.clear();
        (faults::of_ur_arms()[0].plant)(&mut rig, &mut recording);
        let scores = examine(&rig, &recording, &Options::default()).scores;
        assert!(
            !scores.iter().any(|score| score.alternative.ends_with("are swapped")),
            "no chain, no order: {scores:?}"
        );
    }
}

#[test]
fn joints_in_another_order_than_the_rigs_are_the_only_finding_and_nothing_is_learned() {
    let rig = catalog::rig("ur5").unwrap();
    let mut recording =
        simulate(&rig, &SimulateOptions { samples: 12, ..SimulateOptions::default() }).unwrap().recording;
    recording.joints.rotate_left(2);
    let mut steps = 0;
    let diagnosis = examine_watched(&rig, &recording, &Options::default(), &mut |_, _| steps += 1);
    assert!(diagnosis.findings.len() == 1 && diagnosis.scores.is_empty() && steps == 0, "{steps} {diagnosis:?}");
    let finding = &diagnosis.findings[0];
    assert!(finding.what.contains(&recording.joints.join(", ")), "{finding:?}");
    recording.joints.rotate_right(2);
    examine_watched(&rig, &recording, &Options::default(), &mut |hypothesis, _| {
        assert_eq!(hypothesis, "as recorded");
        steps += 1;
    });
    assert!(steps > 0, "what takes long is told");
}

/// Pixels that are off are learned from as if nothing were, and no mistake explains them. Between noise and the grossly wrong nothing is called
/// a fit that is looked into for mistakes.
#[test]
fn a_check_says_that_it_fits_only_where_noise_explains_the_misfit() {
    let folder = Folder::new("check-misfit");
    folder.expect(0, "simulate ur5 --samples 12 --seed 3 -o clean.jsonl");
    let mut recording = Recording::read(&folder.path().join("clean.jsonl")).unwrap();
    let clean = recording.clone();
    for (file, amplitude) in [("off", 15.0), ("slightly", 0.9)] {
        recording.clone_from(&clean);
        for (index, seen) in recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels).enumerate() {
            seen.pixel[0] += amplitude * (97.0 * index as f64).sin();
            seen.pixel[1] += amplitude * (131.0 * index as f64).sin();
        }
        recording.write(&folder.path().join(format!("{file}.jsonl"))).unwrap();
    }
    for (file, least, most, says) in [
        ("clean", 0.5, 1.5, "as recorded it fits: "),
        ("slightly", 1.7, 3.0, "as recorded it does not fit: "),
        ("off", 10.0, 100.0, "as recorded it does not fit: "),
    ] {
        let (text, err) = folder.expect(0, &format!("check ur5 {file}.jsonl"));
        assert!(text.contains(says) && !text.contains("the recording fits"), "{file}: {text}");
        assert!(err.lines().all(|line| line.starts_with("after ")), "a line now and then says how far it is: {err}");
        let (json, _) = folder.expect(0, &format!("check ur5 {file}.jsonl --json"));
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let ratio = json["misfit_over_noise"].as_f64().unwrap();
        assert!((least..most).contains(&ratio), "{file}: {ratio}");
        let tried = json["scores"].as_array().unwrap().len();
        assert_eq!(tried > 1, file != "clean", "{file}: what is not explained is looked into, {tried} hypotheses");
    }
}

/// A prediction has the noise of what was read, here several times that of pixels, as `evaluate` says too.
#[test]
fn noise_of_readings_that_the_rig_states_explains_a_misfit() {
    let mut rig = catalog::rig("ur5").unwrap();
    (rig.noise.pixels, rig.noise.joints) = (0.05, 5e-4);
    let options = SimulateOptions { samples: 20, ..SimulateOptions::default() };
    let recording = simulate(&rig, &options).unwrap().recording;
    let diagnosis = examine(&rig, &recording, &Options::default());
    let misfit = diagnosis.scores[0].misfit.unwrap();
    assert!(misfit.is_explained(&diagnosis.noise) && !misfit.is_explained(&rig.noise), "{misfit}");
    assert_eq!((diagnosis.findings, diagnosis.scores.len()), (Vec::new(), 1));
}

/// Encoders are noisy and limits rounded: what the table of `check` counts as outside is what is found.
#[test]
fn readings_outside_of_limits_are_counted_alike_by_the_table_and_the_finding() {
    let folder = Folder::new("check-limits");
    let rig = catalog::rig("ur5").unwrap();
    let mut recording =
        simulate(&rig, &SimulateOptions { samples: 12, ..SimulateOptions::default() }).unwrap().recording;
    let upper = rig.robot.joints[2].limits.upper.unwrap();
    for (sample, beyond) in recording.samples.iter_mut().zip([0.005, 0.1]) {
        sample.joints.as_mut().unwrap()[2] = upper + beyond;
    }
    recording.write(&folder.path().join("rec.jsonl")).unwrap();
    let (json, _) = folder.expect(0, "check ur5 rec.jsonl --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let name = &rig.robot.joints[2].name;
    assert_eq!(json["recording"]["joints"][name]["outside_limits"], 1);
    let findings = json["findings"].to_string();
    assert!(
        findings.contains(&format!("1 of 12 readings of joint `{name}` are outside the rig's limits")),
        "{findings}"
    );
}

/// A joint may be called anything: what a finding is about is not read off its words.
#[test]
fn names_of_joints_do_not_change_what_is_looked_for() {
    let (rig, mut recording) = faults::targets(2, 30, false);
    let plain = examine(&rig, &recording, &Options::default()).scores;
    recording.joints = vec!["turntable".to_owned(), "lift".to_owned()];
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        sample.joints = Some(vec![0.1 * index as f64, 0.0]);
    }
    let told = examine(&rig, &recording, &Options::default());
    assert!(told.findings.iter().any(|finding| finding.what == "only joint turntable moves"), "{:?}", told.findings);
    assert!(plain.len() > 1, "{plain:?}");
    assert_eq!(told.scores, plain, "poses are examined as before");
}
