//! Simulated recordings have the noise, the gaps and the outliers that were asked for, and nothing else.
use handeye::recording::{Detection, Recording};
use handeye::rig::{Noise, PoseNoise, Rig, catalog};
use handeye::simulate::{SimulateOptions, Simulation, random_rig, simulate};
use handeye::solvers::manifold::so3;

fn ur5() -> Rig {
    catalog::rig("ur5").unwrap()
}

fn text(recording: &Recording) -> String {
    let mut bytes = Vec::new();
    recording.write_to(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// Detections of a simulation with the true pixels of the same features; `None` where a detection is missing.
fn pairs(simulation: &Simulation) -> Vec<(Option<Detection>, Detection)> {
    let samples = simulation.recording.samples.iter().zip(&simulation.truth.samples);
    let find = |measured: &[Detection], truth: &Detection| {
        measured.iter().find(|d| (d.camera, d.feature) == (truth.camera, truth.feature)).copied()
    };
    samples.flat_map(|(m, t)| t.pixels.iter().map(|truth| (find(&m.pixels, truth), *truth))).collect()
}

/// A sample standard deviation of n numbers has itself a standard deviation of σ/√(2n): within 3 of those.
fn has_sd(values: &[f64], sd: f64, what: &str) {
    let n = values.len() as f64;
    let found = (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
    assert!((found - sd).abs() < 3.0 * sd / (2.0 * n).sqrt(), "{what}: {found}, asked for {sd}, {n} values");
    let mean = values.iter().sum::<f64>() / n;
    assert!(mean.abs() < 3.0 * sd / n.sqrt(), "{what}: mean {mean} of {n} values with sd {sd}");
}

#[test]
fn noise_has_the_standard_deviations_of_the_rig() {
    let mut rig = ur5();
    rig.noise = Noise {
        pixels: 0.7,
        points: 0.004,
        joints: 0.002,
        pose: PoseNoise { xyz: 0.003, rot: 0.004 },
        target: None,
        joint_action: 0.005,
        pose_action: PoseNoise { xyz: 0.006, rot: 0.007 },
    };
    let simulation = simulate(&rig, &SimulateOptions { samples: 200, seed: 3, ..SimulateOptions::default() }).unwrap();
    let [mut pixels, mut joints, mut actions] = [const { Vec::new() }; 3];
    let [mut poses, mut turns, mut shifts, mut twists] = [const { Vec::new() }; 4];
    for (measured, truth) in pairs(&simulation) {
        let measured = measured.expect("nothing is missed").pixel;
        pixels.extend([measured[0] - truth.pixel[0], measured[1] - truth.pixel[1]]);
    }
    for (measured, truth) in simulation.recording.samples.iter().zip(&simulation.truth.samples) {
        let differences = |a: &Option<Vec<f64>>, b: &Option<Vec<f64>>| -> Vec<f64> {
            let (a, b) = (a.iter().flatten(), b.iter().flatten());
            a.zip(b).map(|(a, b)| a - b).collect()
        };
        joints.extend(differences(&measured.joints, &truth.joints));
        actions.extend(differences(&measured.joint_action, &truth.joint_action));
        for (measured, truth, shift, turn) in [
            (measured.pose, truth.pose, &mut poses, &mut turns),
            (measured.pose_action, truth.pose_action, &mut shifts, &mut twists),
        ] {
            if let (Some(measured), Some(truth)) = (measured, truth) {
                shift.extend((measured.translation - truth.translation).iter());
                turn.extend(so3::log(&(measured.rotation * truth.rotation.transpose())).iter());
            }
        }
    }
    assert_eq!((joints.len(), actions.len(), poses.len(), shifts.len()), (1200, 1194, 600, 597));
    has_sd(&pixels, 0.7, "pixels");
    has_sd(&joints, 0.002, "joints");
    has_sd(&actions, 0.005, "joint actions");
    has_sd(&poses, 0.003, "pose, translation");
    has_sd(&turns, 0.004, "pose, rotation");
    has_sd(&shifts, 0.006, "pose action, translation");
    has_sd(&twists, 0.007, "pose action, rotation");
}

#[test]
fn what_has_no_noise_is_exact_or_is_not_recorded() {
    let mut rig = ur5();
    rig.noise = Noise { pixels: 0.0, ..Noise::default() };
    let Simulation { recording, truth, .. } = simulate(&rig, &SimulateOptions::default()).unwrap();
    for (measured, truth) in recording.samples.iter().zip(&truth.samples) {
        assert_eq!((&measured.joints, &measured.pixels), (&truth.joints, &truth.pixels));
        assert!(measured.pose.is_none() && truth.pose.is_some());
        assert!(measured.joint_action.is_none() && measured.pose_action.is_none());
    }
    let evaluation = handeye::calibrate::evaluate(&rig, &recording).unwrap();
    assert!(evaluation.total.max_px < 1e-9, "the rig predicts its own recording: {} px", evaluation.total.max_px);
}

#[test]
fn actions_lead_from_a_sample_to_the_next() {
    let mut rig = ur5();
    rig.noise.joint_action = 1e-9;
    rig.noise.pose_action.rot = 1e-9;
    let Simulation { truth, .. } = simulate(&rig, &SimulateOptions::default()).unwrap();
    for pair in truth.samples.windows(2) {
        let action = pair[0].joint_action.as_ref().unwrap();
        for ((now, action), next) in pair[0].joints.iter().flatten().zip(action).zip(pair[1].joints.iter().flatten()) {
            assert!((now + action - next).abs() < 1e-14);
        }
        let led_to = pair[0].pose_action.unwrap() * pair[0].pose.unwrap();
        assert!((led_to.translation - pair[1].pose.unwrap().translation).norm() < 1e-13);
        assert!(led_to.angle_to(&pair[1].pose.unwrap()) < 1e-7);
    }
    assert_eq!(truth.samples.last().unwrap().joint_action, None);
}

#[test]
fn as_many_detections_are_missing_or_wrong_as_was_asked_for() {
    let options = SimulateOptions { samples: 100, missed: 0.3, outliers: 0.1, ..SimulateOptions::default() };
    let simulation = simulate(&ur5(), &options).unwrap();
    let pairs = pairs(&simulation);
    // Counts of independent events are binomial: np within 3 √(np(1-p)).
    let binomial = |count: usize, n: usize, p: f64| {
        let (count, n) = (count as f64, n as f64);
        assert!((count - n * p).abs() < 3.0 * (n * p * (1.0 - p)).sqrt(), "{count} of {n}, asked for a share of {p}");
    };
    let seen: Vec<_> = pairs.iter().filter_map(|(measured, truth)| measured.map(|m| (m.pixel, truth.pixel))).collect();
    binomial(pairs.len() - seen.len(), pairs.len(), 0.3);
    assert_eq!(simulation.missed, pairs.len() - seen.len());
    binomial(simulation.outliers, seen.len(), 0.1);
    // 6 px is 20 standard deviations; an outlier is nearer by chance with probability π 6² / (640 · 480) = 0.0004.
    let far = seen.iter().filter(|(m, t)| (m[0] - t[0]).hypot(m[1] - t[1]) > 6.0).count();
    assert!(simulation.outliers - far <= 3, "{far} of {} outliers are far off", simulation.outliers);
    assert!(seen.iter().all(|(m, _)| (-2.5..641.5).contains(&m[0]) && (-2.5..481.5).contains(&m[1])));
}

#[test]
fn joints_stay_within_their_limits_and_features_in_the_images() {
    for rig in [ur5(), random_rig(6, 2, 12, 5), random_rig(7, 3, 12, 6)] {
        let Simulation { truth, .. } = simulate(&rig, &SimulateOptions::default()).unwrap();
        for sample in &truth.samples {
            for (reading, joint) in sample.joints.iter().flatten().zip(&rig.robot.joints) {
                assert!((joint.limits.lower.unwrap()..=joint.limits.upper.unwrap()).contains(reading));
            }
            for camera in 0..rig.cameras.len() {
                let seen: Vec<_> = sample.pixels.iter().filter(|d| d.camera as usize == camera).collect();
                assert!(seen.len() >= 6, "camera {camera} sees {} of 12 features", seen.len());
                let inside =
                    |d: &&Detection| (-0.5..639.5).contains(&d.pixel[0]) && (-0.5..479.5).contains(&d.pixel[1]);
                assert!(seen.iter().all(inside));
            }
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let with = |options: &SimulateOptions| simulate(&ur5(), options).unwrap();
    let options = SimulateOptions { samples: 20, missed: 0.2, outliers: 0.1, ..SimulateOptions::default() };
    let first = with(&options);
    assert_eq!(text(&first.recording), text(&with(&options).recording));
    assert_ne!(text(&first.recording), text(&with(&SimulateOptions { seed: 2, ..options.clone() }).recording));
    let cleaner = with(&SimulateOptions { missed: 0.0, outliers: 0.0, ..options.clone() });
    assert_eq!(first.truth, cleaner.truth, "the motions do not depend on what is missed");
    let longer = with(&SimulateOptions { samples: 30, ..options });
    assert_eq!(first.truth.samples[..], longer.truth.samples[..20], "more samples begin with the fewer");
    assert_eq!(first.recording.samples[..], longer.recording.samples[..20]);
    assert_eq!(random_rig(6, 2, 12, 1), random_rig(6, 2, 12, 1));
}

#[test]
fn a_written_simulation_reads_back_as_it_was() {
    let recording = simulate(&ur5(), &SimulateOptions::default()).unwrap().recording;
    let read = Recording::read_from(text(&recording).as_bytes(), "memory").unwrap();
    assert_eq!(read, recording);
    let names: Vec<&str> = read.features.iter().map(String::as_str).collect();
    assert_eq!(names, ["f0", "f1", "f2", "f3", "f4", "f5", "f6", "f7", "f8", "f9", "f10", "f11"]);
}

#[test]
fn rare_views_are_found_too() {
    let mut rig = ur5();
    for joint in &mut rig.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (None, None);
    }
    for camera in &mut rig.cameras {
        (camera.fx, camera.fy) = (Some(3000.0), Some(3000.0));
    }
    let Simulation { truth, .. } = simulate(&rig, &SimulateOptions { samples: 5, ..Default::default() }).unwrap();
    assert!(truth.samples.iter().all(|sample| sample.pixels.len() >= 12));
}

#[test]
fn a_camera_that_looks_away_is_named() {
    let mut rig = ur5();
    let pose = rig.cameras[1].pose.unwrap();
    let turned =
        handeye::solvers::Pose::new(nalgebra::Vector3::new(0.0, std::f64::consts::PI, 0.0), Default::default());
    rig.cameras[1].pose = Some(pose * turned);
    let error = simulate(&rig, &SimulateOptions::default()).unwrap_err();
    assert!(!error.is_input());
    let message = error.to_string();
    assert!(message.contains("camera `right` sees at most 0 of 12") && message.contains("limits"), "{message}");
    assert!(!message.contains("`left`"), "{message}");
}

#[test]
fn what_cannot_be_simulated_is_told_with_what_is_missing() {
    let message = |change: &dyn Fn(&mut Rig, &mut SimulateOptions)| {
        let (mut rig, mut options) = (ur5(), SimulateOptions::default());
        change(&mut rig, &mut options);
        let error = simulate(&rig, &options).unwrap_err();
        assert!(error.is_input());
        error.to_string()
    };
    assert!(message(&|rig, _| rig.robot.joints[2].a = None).contains("robot.joints.elbow.a"));
    assert!(message(&|rig, _| rig.cameras[0].size = None).contains("`size` of camera `left`"));
    assert!(message(&|rig, _| rig.features.clear()).contains("no features"));
    assert!(message(&|rig, _| rig.cameras.clear()).contains("no cameras"));
    assert!(message(&|_, options| options.samples = 0).contains("at least 1"));
    assert!(message(&|_, options| options.missed = f64::NAN).contains("`missed`"));
    let slide = |rig: &mut Rig, _: &mut SimulateOptions| {
        rig.robot.joints[0].kind = handeye::chain::JointKind::Prismatic;
        rig.robot.joints[0].limits.lower = None;
    };
    assert!(message(&slide).contains("`shoulder_pan` is prismatic"));
}

#[test]
fn random_rigs_can_be_seen_moving_whatever_is_asked_for() {
    for (joints, cameras, features, seed) in [(6, 1, 12, 1), (7, 3, 12, 2), (6, 8, 4, 3), (2, 2, 1, 4), (0, 1, 3, 5)] {
        let rig = random_rig(joints, cameras, features, seed);
        let simulation = simulate(&rig, &SimulateOptions { samples: 10, ..SimulateOptions::default() }).unwrap();
        assert_eq!(simulation.recording.samples.len(), 10);
        assert_eq!((rig.robot.joints.len(), rig.cameras.len(), rig.features.len()), (joints, cameras, features));
    }
    for seed in 0..50 {
        let rig = random_rig(6, 2, 12, seed);
        let reach: f64 = rig.robot.joints.iter().map(|joint| joint.a.unwrap().hypot(joint.d.unwrap())).sum();
        assert!((0.4..2.5).contains(&reach), "seed {seed}: {reach} m");
        assert!(rig.robot.joints.iter().all(|joint| (joint.alpha.unwrap().abs() - 1.57).abs() < 0.31));
    }
}
