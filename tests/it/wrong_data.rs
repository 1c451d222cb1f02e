//! Wrong data are named, each by its right sample and camera and nothing else, and do not spoil what is learned.
use crate::learning::{Normal, learn, nominal_chain, nothing, over_floor, record};
use handeye::calibrate::{Calibration, Finding, evaluate};
use handeye::recording::{Detection, Recording};
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use nalgebra::Vector3;

const SEEDS: u64 = 5;
const SAMPLES: usize = 50;

/// A finding without its numbers.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Named {
    Joints(usize, Option<usize>),
    Image(usize, String),
    Moved(String),
    Unseen(String),
    Misfit,
}

/// What is named, but for single detections.
fn named(learned: &Calibration) -> Vec<Named> {
    let name = |finding: &Finding| match finding {
        Finding::WrongJoints { sample, swapped_with, .. } => Some(Named::Joints(*sample, *swapped_with)),
        Finding::WrongImage { sample, camera, .. } => Some(Named::Image(*sample, camera.clone())),
        Finding::CameraMoved { camera, .. } => Some(Named::Moved(camera.clone())),
        Finding::UnseenCamera { camera } => Some(Named::Unseen(camera.clone())),
        Finding::Misfit { .. } => Some(Named::Misfit),
        Finding::Outliers { .. }
        | Finding::UnknownState { .. }
        | Finding::Lag { .. }
        | Finding::MissedLength { .. }
        | Finding::FarFromGiven { .. } => None,
    };
    let mut named: Vec<Named> = learned.report.findings.iter().filter_map(name).collect();
    named.sort();
    named
}

/// Plants faults in the recording of every seed, and expects what `plant` says to be named; from nothing, and from the
/// chain of a data sheet.
fn are_named(cameras: usize, outliers: f64, plant: impl Fn(&mut Recording, &Rig, u64) -> Vec<Named>) {
    let mut failures = Vec::new();
    for seed in 0..SEEDS {
        let truth = random_rig(6, cameras, 12, seed);
        let options = SimulateOptions { samples: SAMPLES, seed, outliers, ..SimulateOptions::default() };
        let mut recording = simulate(&truth, &options).unwrap().recording;
        let mut expected = plant(&mut recording, &truth, seed);
        expected.sort();
        for (start, rig) in [("nothing", nothing(&truth)), ("nominal", nominal_chain(&truth, seed))] {
            match learn(&rig, &recording) {
                Ok(learned) => {
                    let (found, ratio) = (named(&learned), over_floor(&learned.rig, &truth, seed));
                    if found != expected || ratio > 1.10 {
                        failures.push(format!("{start}, seed {seed}: {ratio:.3}, {found:?} for {expected:?}"));
                    }
                }
                Err(error) => failures.push(format!("{start}, seed {seed}: {error}")),
            }
        }
    }
    assert!(failures.is_empty(), "{} of {}: {failures:#?}", failures.len(), 2 * SEEDS);
}

/// A pair of samples, other ones for every seed.
fn pair(seed: u64) -> (usize, usize) {
    ((3 + 7 * seed as usize) % 24, 25 + (5 * seed as usize) % 24)
}

fn swap_joints(recording: &mut Recording, (a, b): (usize, usize)) -> [Named; 2] {
    let of_a = recording.samples[a].joints.take();
    recording.samples[a].joints = recording.samples[b].joints.take();
    recording.samples[b].joints = of_a;
    [Named::Joints(a, Some(b)), Named::Joints(b, Some(a))]
}

/// Joints of another position, of which there is no image.
fn spoil_joints(recording: &mut Recording, truth: &Rig, seed: u64, sample: usize) -> Named {
    recording.samples[sample].joints = record(truth, 1, seed + 5000).samples[0].joints.clone();
    Named::Joints(sample, None)
}

/// The image of a camera is that of another sample.
fn spoil_image(recording: &mut Recording, camera: u32, sample: usize, from: usize) -> Named {
    let mut others: Vec<Detection> = recording.samples[from].pixels.clone();
    others.retain(|detection| detection.camera == camera);
    let pixels = &mut recording.samples[sample].pixels;
    pixels.retain(|detection| detection.camera != camera);
    pixels.extend(others);
    pixels.sort_by_key(|detection| (detection.camera, detection.feature));
    Named::Image(sample, recording.cameras[camera as usize].name.clone())
}

#[test]
fn good_data_have_nothing_named() {
    are_named(2, 0.0, |_, _, _| Vec::new());
    are_named(3, 0.0, |_, _, _| Vec::new());
}

#[test]
fn two_swapped_rows_of_joints_are_named_with_each_other() {
    are_named(2, 0.0, |recording, _, seed| swap_joints(recording, pair(seed)).into());
}

#[test]
fn a_wrong_row_of_joints_is_named() {
    are_named(2, 0.0, |recording, truth, seed| vec![spoil_joints(recording, truth, seed, pair(seed).0)]);
}

#[test]
fn an_image_of_another_sample_is_named_with_its_camera() {
    for cameras in [2, 3] {
        are_named(cameras, 0.0, |recording, _, seed| {
            let (a, b) = pair(seed);
            vec![spoil_image(recording, (seed % cameras as u64) as u32, a, b)]
        });
    }
}

#[test]
fn several_faults_among_outliers_are_all_named() {
    for cameras in [2, 3] {
        are_named(cameras, 0.05, |recording, truth, seed| {
            let (a, b) = pair(seed);
            let mut planted: Vec<Named> = swap_joints(recording, (a, b)).into();
            planted.push(spoil_joints(recording, truth, seed, a + 1));
            planted.push(spoil_image(recording, (seed % cameras as u64) as u32, (b + 3) % SAMPLES, 20));
            planted
        });
    }
}
/// Shifts and turns one of three cameras by 2 cm and 2 degrees after a part of the recording.
fn a_bump_is_named(before: usize) {
    let mut failures = Vec::new();
    for seed in 0..SEEDS {
        let truth = random_rig(6, 3, 12, seed);
        let bumped = (seed % 3) as usize;
        let mut moved = truth.clone();
        let mut normal = Normal::new(seed);
        let mut direction = |length: f64| Vector3::from_fn(|_, _| normal.draw(1.0)).normalize() * length;
        let bump = Pose::new(direction(2.0_f64.to_radians()), direction(0.02));
        moved.cameras[bumped].pose = truth.cameras[bumped].pose.map(|pose| pose * bump);
        let mut recording = record(&truth, before, seed);
        recording.samples.extend(record(&moved, SAMPLES - before, seed + 5000).samples);
        let expected = [Named::Moved(truth.cameras[bumped].name.clone())];
        for (start, rig) in [("nothing", nothing(&truth)), ("nominal", nominal_chain(&truth, seed))] {
            match learn(&rig, &recording) {
                Ok(learned) => {
                    let judged = evaluate(&learned.rig, &record(&truth, 100, seed + 9000)).unwrap();
                    let floor = truth.noise.pixels * 2.0_f64.sqrt();
                    let ratios: Vec<f64> = judged.cameras.iter().map(|camera| camera.errors.rms_px / floor).collect();
                    // Where most of the recording has the camera, its pose is that from before the bump.
                    let bar = |camera: usize| match camera == bumped {
                        false => 1.10,
                        true if 3 * before > 2 * SAMPLES => 1.30,
                        true => f64::INFINITY,
                    };
                    let found = named(&learned);
                    if found != expected || (0..3).any(|camera| ratios[camera] > bar(camera)) {
                        failures.push(format!("{start}, seed {seed}: {ratios:.3?}, {found:?} for {expected:?}"));
                    }
                }
                Err(error) => failures.push(format!("{start}, seed {seed}: {error}")),
            }
        }
    }
    assert!(failures.is_empty(), "{} of {}: {failures:#?}", failures.len(), 2 * SEEDS);
}

#[test]
fn a_camera_that_is_bumped_halfway_is_named() {
    a_bump_is_named(SAMPLES / 2);
}

#[test]
fn a_camera_that_is_bumped_late_stays_where_it_was_before() {
    a_bump_is_named(4 * SAMPLES / 5);
}

#[test]
fn a_wrong_tip_pose_is_called_that() {
    let truth = random_rig(6, 2, 12, 3);
    let simulated = simulate(&truth, &SimulateOptions { samples: SAMPLES, ..SimulateOptions::default() }).unwrap();
    let mut recording = simulated.recording;
    recording.joints.clear();
    for (sample, truth) in recording.samples.iter_mut().zip(&simulated.truth.samples) {
        (sample.joints, sample.pose) = (None, truth.pose);
    }
    let mut swapped = recording.clone();
    (swapped.samples[4].pose, swapped.samples[9].pose) = (recording.samples[9].pose, recording.samples[4].pose);
    let findings = learn(&nothing(&truth), &swapped).unwrap().report.findings;
    let told: Vec<String> = findings.iter().map(Finding::to_string).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].starts_with("sample 4: its tip pose does not lead to what the cameras saw"), "{told:?}");
    assert!(
        told[0].contains("it fits the images of sample 9: the two are swapped, and both were left out"),
        "{told:?}"
    );
}
