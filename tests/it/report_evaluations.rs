//! An evaluation says what is wrong and what is not: with noisy readings, samples that fit poorly, and a camera or base that was moved.
use crate::cli::Folder;
use crate::learning::{learn, record};
use crate::report_answers::shown;
use handeye::calibrate::{CameraErrors, Distance, Evaluation, evaluate};
use handeye::recording::Recording;
use handeye::report::{Subject, evaluation_html, evaluation_steps, html};
use handeye::rig::{Parent, PoseNoise, Rig, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use handeye::solvers::Pose;
use nalgebra::Vector3;
use serde_json::Value;

const NO_STEP: &str = "nothing needs to be done";

/// A camera turned by 3 degrees.
fn bumped(truth: &Rig, camera: usize) -> Rig {
    let mut moved = truth.clone();
    let turn = Pose::new(Vector3::new(0.0, 0.05, 0.0), Vector3::zeros());
    moved.cameras[camera].pose = moved.cameras[camera].pose.map(|pose| pose * turn);
    moved
}

#[test]
fn noise_of_readings_is_not_taken_for_a_camera_or_an_arm_that_moved() {
    let mut by_joints = catalog::rig("ur5").unwrap();
    by_joints.noise.joints = 0.01;
    let mut by_poses = catalog::rig("ur5").unwrap();
    by_poses.noise.pose = PoseNoise { xyz: 0.003, rot: 0.005 };
    for (truth, is_pose) in [(by_joints, false), (by_poses, true)] {
        let record = |rig: &Rig, seed: u64| {
            let simulated = simulate(rig, &SimulateOptions { samples: 40, seed, ..SimulateOptions::default() });
            let mut recording = simulated.unwrap().recording;
            recording.samples.iter_mut().filter(|_| is_pose).for_each(|sample| sample.joints = None);
            recording
        };
        let learned = learn(&truth, &record(&truth, 1)).unwrap().rig;
        let judged = evaluate(&learned, &record(&truth, 2)).unwrap();
        // The readings' noise is most of the error, and is known to about a tenth from 40 samples.
        let usual = learned.fit.as_ref().unwrap().rms_px;
        let of_readings = judged.reading_noise.0.px;
        assert!(judged.total.rms_px > 3.0 * usual, "{} {usual}", judged.total.rms_px);
        assert!((judged.total.rms_px / of_readings.hypot(usual) - 1.0).abs() < 0.2, "{of_readings}");
        let steps = evaluation_steps(&learned, &judged);
        assert!(steps.len() == 1 && steps[0].contains(NO_STEP) && steps[0].contains("noise"), "{steps:?}");
        // Three degrees are some 30 px, which such noise does not hide.
        let judged = evaluate(&learned, &record(&bumped(&truth, 0), 2)).unwrap();
        let steps = evaluation_steps(&learned, &judged).join("\n");
        assert!(steps.contains("cameras.left") && !steps.contains(NO_STEP), "{steps}");
    }
}

#[test]
fn samples_that_are_off_but_not_wrong_are_named() {
    let truth = catalog::rig("ur5").unwrap();
    let learned = learn(&truth, &record(&truth, 40, 1)).unwrap().rig;
    let mut fresh = record(&truth, 30, 2);
    assert_eq!(evaluate(&learned, &fresh).unwrap().fitting.poor, []);
    // Six and five standard deviations of 0.3 px.
    for (sample, by) in [(7, 1.5), (11, 1.8)] {
        fresh.samples[sample].pixels.iter_mut().for_each(|seen| seen.pixel[0] += by);
    }
    let judged = evaluate(&learned, &fresh).unwrap();
    let [(11, Distance::Pixels(worst)), (7, Distance::Pixels(other))] = judged.fitting.poor[..] else {
        panic!("{:?}", judged.fitting);
    };
    assert!((worst - 1.8).abs() < 0.3 && (other - 1.5).abs() < 0.3, "{worst} {other}");
    assert!(judged.fitting.findings.is_empty(), "{:?}", judged.fitting.findings);
    let folder = Folder::new("report-poor");
    fresh.write(&folder.path().join("fresh.jsonl")).unwrap();
    learned.write(&folder.path().join("learned.toml"), None).unwrap();
    let (said, _) = folder.expect(0, "evaluate learned.toml fresh.jsonl");
    assert!(said.contains("sample 11 at 11.000 s (1.") && said.contains("sample 7 at 7.000 s (1."), "{said}");
}

/// What one rule leaves out is what every figure leaves out, where one camera is noisier than the other too.
#[test]
fn the_page_counts_as_left_out_what_was_left_out() {
    let mut truth = catalog::rig("ur5").unwrap();
    truth.noise.pixels = 0.1;
    let mut recording = record(&truth, 40, 3);
    for (number, seen) in recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels).enumerate() {
        let far = if number % 37 == 0 { 5.0 } else { 0.8 };
        if seen.camera == 1 {
            seen.pixel[number % 2] += if number % 4 < 2 { far } else { -far };
        }
    }
    let learned = learn(&truth, &recording).unwrap();
    let rejected = learned.report.rejected;
    assert!(rejected > 2, "{rejected}");
    let subject = Subject {
        about: "one rule".into(),
        before: &truth,
        calibration: &learned,
        recording: &recording,
        suggestion: None,
        tables: &[],
    };
    let words = format!("The {rejected} detections that do not fit are not counted.");
    let page = html(&subject).unwrap();
    let histogram = page.split("<section id=\"histogram\">").nth(1).unwrap().split("<svg").next().unwrap();
    assert!(histogram.contains(&words), "{words} {histogram}");
}

#[test]
fn nothing_is_said_to_be_left_out_where_nothing_is_learned() {
    let truth = catalog::rig("ur5").unwrap();
    let mut recording = record(&truth, 30, 2);
    let other = recording.samples[3].joints.clone();
    recording.samples[9].joints = other;
    recording.samples[20].pixels.iter_mut().find(|seen| seen.camera == 1).unwrap().pixel[0] += 50.0;
    recording.samples[24..].iter_mut().flat_map(|sample| &mut sample.pixels).for_each(|seen| {
        seen.pixel[1] += if seen.camera == 0 { 20.0 } else { 0.0 };
    });
    let folder = Folder::new("report-words");
    recording.write(&folder.path().join("fresh.jsonl")).unwrap();
    truth.write(&folder.path().join("rig.toml"), None).unwrap();
    let (json, _) = folder.expect(0, "evaluate rig.toml fresh.jsonl --report page.html --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    let findings = json["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 3, "{json}");
    let page = folder.read("page.html");
    for finding in findings {
        let text = finding["text"].as_str().unwrap();
        assert!(!text.contains("left out") && !text.contains("during the recording"), "{text}");
        assert!(page.contains(&shown(text)), "{text}");
    }
}

#[test]
fn a_bump_of_the_only_camera_is_a_change_and_no_mistake_of_the_recording() {
    let mut truth = catalog::rig("ur5").unwrap();
    truth.cameras.truncate(1);
    let mut recording = record(&truth, 24, 2);
    recording.samples.extend(record(&bumped(&truth, 0), 16, 3).samples);
    let learned = learn(&truth, &record(&truth, 40, 1)).unwrap().rig;
    let judged = evaluate(&learned, &recording).unwrap();
    let steps = evaluation_steps(&learned, &judged);
    assert!(steps[0].starts_with("From sample 24 on") && steps[0].contains("--relearn cameras.left"), "{steps:?}");
    let steps = steps.join("\n");
    assert!(!steps.contains(NO_STEP) && !steps.contains("mistakes of the recording"), "{steps}");
    let relearned = learn(&truth, &recording).unwrap();
    let subject = Subject {
        about: "bumped".into(),
        before: &truth,
        calibration: &relearned,
        recording: &recording,
        suggestion: None,
        tables: &[],
    };
    let page = html(&subject).unwrap();
    assert!(page.contains("From sample 24 on") && !page.contains("what does not fit was left out of it"));
    // Three wrong readings here and there are mistakes.
    let mut mistaken = record(&truth, 40, 2);
    for sample in [5, 18, 31] {
        mistaken.samples[sample].joints = mistaken.samples[sample + 1].joints.clone();
    }
    let steps = evaluation_steps(&learned, &evaluate(&learned, &mistaken).unwrap()).join("\n");
    assert!(steps.contains(NO_STEP) && steps.contains("mistakes of the recording"), "{steps}");
}

/// Of a sample with nothing but a tip pose, what is fixed to an inner link cannot be predicted.
#[test]
fn what_hangs_on_an_inner_link_is_not_compared_where_only_the_tip_was_read() {
    let mut truth = catalog::rig("ur5").unwrap();
    truth.features[0].parent = Parent::Link(3);
    let simulated = simulate(&truth, &SimulateOptions { samples: 10, ..SimulateOptions::default() }).unwrap();
    let mut recording: Recording = simulated.recording;
    for (sample, exact) in recording.samples.iter_mut().zip(&simulated.truth.samples) {
        (sample.joints, sample.pose) = (None, exact.pose);
    }
    let on_link = recording.samples.iter().flat_map(|sample| &sample.pixels).filter(|seen| seen.feature == 0).count();
    let judged: Evaluation = evaluate(&truth, &recording).unwrap();
    assert!(on_link > 0 && judged.rejected == on_link, "{on_link} {}", judged.rejected);
    let is_fine = |camera: &CameraErrors| camera.errors.rms_px < 0.6;
    assert!(judged.cameras.iter().all(is_fine), "{:?}", judged.cameras);
    assert!(evaluation_html(&"tips".into(), &truth, &recording, &judged).is_ok());
}
