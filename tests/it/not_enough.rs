//! Where the data do not suffice, a message says what is missing, and nothing panics or learns what is not a number.
use crate::learning::{Normal, learn, nothing, pixel_noise, record, variants};
use handeye::Error;
use handeye::calibrate::Calibration;
use handeye::recording::{Detection, Recording, Sample};
use handeye::rig::{Feature, Model, Parent, Rig};
use handeye::simulate::random_rig;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A plain rig and a good recording of it: what is changed is what fails.
fn good() -> (Rig, Recording) {
    let truth = random_rig(6, 2, 12, 1);
    let recording = record(&truth, 40, 1);
    (truth, recording)
}

/// The data do not suffice, and the message has all of `words`.
fn is_missing(rig: &Rig, recording: &Recording, words: &[&str]) {
    match learn(rig, recording) {
        Ok(learned) => panic!("learned with {:.3} px rms, expected to miss {words:?}", learned.report.rms_px),
        Err(error) => {
            let message = error.to_string();
            println!("{message}");
            assert!(matches!(error, Error::NotEnoughData(_)) && !error.is_input(), "{message}");
            assert!(words.iter().all(|word| message.contains(word)), "{message}\nlacks one of {words:?}");
            assert!(message.starts_with(|c: char| !c.is_uppercase()) && !message.ends_with('.'), "{message}");
        }
    }
}

fn keep(recording: &mut Recording, keep: impl Fn(usize, &Detection) -> bool) {
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        sample.pixels.retain(|detection| keep(index, detection));
    }
}

#[test]
fn cameras_that_see_other_features_and_other_samples_share_nothing() {
    let (truth, mut recording) = good();
    keep(&mut recording, |sample, seen| {
        (seen.camera == 0) == (sample < 20) && (seen.camera == 0) == (seen.feature < 6)
    });
    is_missing(&nothing(&truth), &recording, &["cam2", "shares too few features"]);
}

#[test]
fn three_samples_do_not_make_a_chain() {
    let (truth, recording) = good();
    is_missing(&nothing(&truth), &recording.select(|sample| sample < 3), &["3 samples", "6 joints"]);
}

/// Nothing is learned, or it is said that nothing determines it and no tip's deviation is given.
fn is_left_open(rig: &Rig, recording: &Recording) {
    match learn(rig, recording) {
        Ok(Calibration { report, .. }) => {
            let says = report.gauge.iter().any(|line| line.starts_with("nothing determines"));
            assert!(says && report.tip.is_none(), "{:?} {:#?}", report.tip, report.gauge);
        }
        Err(error) => assert!(matches!(error, Error::NotEnoughData(_)), "{error}"),
    }
}

#[test]
fn one_sample_does_not_become_more_by_repetition() {
    let (truth, mut recording) = good();
    recording.samples = vec![recording.samples[0].clone(); 40];
    is_left_open(&nothing(&truth), &recording);
    let with_chain = Rig { robot: truth.robot.clone(), ..nothing(&truth) };
    is_missing(&with_chain, &recording, &["samples", "axis"]);
}

#[test]
fn features_that_are_seen_once_determine_nothing() {
    let (truth, mut recording) = good();
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        for detection in &mut sample.pixels {
            detection.feature += 12 * index as u32;
        }
        sample.pixels.retain(|detection| (detection.camera as usize + index).is_multiple_of(2));
    }
    recording.features = (0..40 * 12).map(|index| format!("f{index}")).collect();
    is_missing(&nothing(&truth), &recording, &["cam1", "cam2"]);
}

#[test]
fn a_feature_that_is_seen_once_is_named() {
    let (truth, mut recording) = good();
    recording.features.push("spark".to_owned());
    recording.samples[7].pixels.push(Detection { camera: 1, feature: 12, pixel: [300.0, 200.0] });
    is_missing(&nothing(&truth), &recording, &["`spark`", "1 time"]);
}

#[test]
fn a_feature_of_the_rig_that_is_never_seen_is_named_unless_its_place_is_given() {
    let (truth, recording) = good();
    let mut rig = nothing(&truth);
    rig.features.push(Feature { name: "ghost".to_owned(), parent: Parent::Tip, xyz: None });
    is_missing(&rig, &recording, &["`ghost`", "0 times"]);
    let mut rig = truth;
    rig.features.push(Feature { name: "ghost".to_owned(), parent: Parent::Tip, xyz: Some([0.0, 0.0, 0.1]) });
    assert!(learn(&rig, &recording).is_ok());
}

/// Only the last joint moves: everything turns about one axis.
fn about_one_axis() -> (Rig, Recording) {
    let mut truth = random_rig(6, 2, 12, 1);
    let position = record(&truth, 1, 1).samples[0].joints.clone().unwrap();
    for (joint, at) in truth.robot.joints.iter_mut().zip(&position).take(5) {
        (joint.limits.lower, joint.limits.upper) = (Some(*at), Some(*at));
    }
    let recording = record(&truth, 40, 2);
    (truth, recording)
}

#[test]
fn what_one_axis_cannot_tell_is_left_open() {
    let (truth, recording) = about_one_axis();
    is_left_open(&nothing(&truth), &recording);
    is_left_open(&Rig { robot: truth.robot.clone(), ..nothing(&truth) }, &recording);
}

#[test]
fn a_recording_without_joints_or_without_images_is_told() {
    let (truth, recording) = good();
    let mut without = recording.clone();
    without.samples.iter_mut().for_each(|sample| sample.joints = None);
    is_missing(&nothing(&truth), &without, &["no sample", "joints"]);
    let mut blind = recording.clone();
    keep(&mut blind, |_, _| false);
    is_missing(&nothing(&truth), &blind, &["no sample", "feature"]);
    is_missing(&truth, &blind, &["no sample", "feature"]);
    is_missing(&truth, &recording.select(|_| false), &["no sample"]);
}

#[test]
fn what_is_held_needs_a_value() {
    let (truth, recording) = good();
    for path in ["robot.joints.j3.alpha", "cameras.cam1.pose", "features.f2.xyz"] {
        let mut rig = variants::forgotten(&truth);
        rig.robot.joints = truth.robot.joints.clone();
        rig.robot.joints[2].alpha = None;
        rig.estimate.fixed = vec![path.to_owned()];
        let error = learn(&rig, &recording).unwrap_err();
        assert!(matches!(error, Error::Unusable(_)) && error.is_input(), "{error}");
        assert!(error.to_string().contains(&format!("`{path}`")), "{error}");
    }
}

/// A recording that is spoilt in several of many ways.
fn spoilt(seed: u64) -> (Rig, Recording) {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let [cameras, features] = [random.random_range(1..=3), random.random_range(1..=12)];
    let mut truth = random_rig(random.random_range(1..=7), cameras, features, seed);
    truth.noise = pixel_noise([0.0, 0.3, 50.0][random.random_range(0..3)]);
    let mut recording = record(&truth, random.random_range(1..=30), seed);
    for way in 0..6 {
        if random.random_bool(0.7) {
            continue;
        }
        match way {
            0 => {
                let kept = random.random_range(0.05..1.0);
                let samples = recording.samples.iter_mut();
                samples.for_each(|sample| sample.pixels.retain(|_| random.random_bool(kept)));
            }
            1 => {
                let samples = recording.samples.clone();
                recording
                    .samples
                    .iter_mut()
                    .for_each(|sample| *sample = samples[random.random_range(0..samples.len().min(4))].clone());
            }
            2 => {
                let joint = random.random_range(0..recording.joints.len());
                let value = [0.0, 1e6, 1e-9][random.random_range(0..3)];
                recording
                    .samples
                    .iter_mut()
                    .flat_map(|sample| &mut sample.joints)
                    .for_each(|joints| joints[joint] = value);
            }
            3 => {
                let samples = recording.samples.iter_mut().filter(|_| random.random_bool(0.5));
                samples.for_each(|Sample { joints, .. }| *joints = None);
            }
            4 => {
                let pixel = [random.random_range(-1e4..1e4), 240.0];
                let seen = recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels);
                seen.filter(|seen| seen.feature == 0).for_each(|seen| seen.pixel = pixel);
            }
            _ => recording.cameras.iter_mut().for_each(|camera| {
                (camera.fx, camera.fy, camera.cx, camera.cy, camera.size) = (None, None, None, None, None);
            }),
        }
    }
    let mut start = if random.random_bool(0.3) { truth.clone() } else { nothing(&truth) };
    if random.random_bool(0.3) {
        start.robot = truth.robot.clone();
    }
    start.noise = pixel_noise(0.3);
    (start, recording)
}

/// Every number of a learned rig is one.
fn is_finite(rig: &Rig) -> bool {
    let Ok(model) = Model::new(rig) else { return false };
    let fit = rig.fit.as_ref().unwrap();
    let poses = model.cameras.iter().map(|camera| camera.pose).chain([model.base]);
    let features = model.features.iter().flat_map(|feature| feature.xyz.data.0[0]);
    let intrinsics = model.cameras.iter().flat_map(|camera| camera.intrinsics);
    model.parameters.iter().copied().chain(features).chain(intrinsics).all(f64::is_finite)
        && poses.into_iter().all(|pose| pose.rotation.iter().chain(pose.translation.iter()).all(|x| x.is_finite()))
        && [fit.rms_px, fit.mean_px].iter().chain(fit.sd.values().flatten()).all(|x| x.is_finite())
}

/// In two parts, so that two cores have something to do.
fn nothing_spoilt_panics(seeds: std::ops::Range<u64>) {
    let mut failures = Vec::new();
    let mut learned = 0;
    for seed in seeds.clone() {
        let (start, recording) = spoilt(seed);
        match catch_unwind(AssertUnwindSafe(|| learn(&start, &recording))) {
            Err(_) => failures.push(format!("seed {seed}: panics")),
            Ok(Ok(calibration)) if !is_finite(&calibration.rig) => failures.push(format!("seed {seed}: not a number")),
            Ok(Ok(calibration)) => {
                learned += 1;
                // What was learned can be written and read.
                let text = calibration.rig.to_toml();
                if let Err(error) = Rig::parse(&text, "learned.toml") {
                    failures.push(format!("seed {seed}: {error}"));
                }
            }
            Ok(Err(Error::NotEnoughData(message) | Error::Unusable(message))) => {
                if message.contains("NaN") || message.len() < 20 {
                    failures.push(format!("seed {seed}: {message}"));
                }
            }
            Ok(Err(error)) => failures.push(format!("seed {seed}: {error}")),
        }
    }
    println!("{learned} of {} learned", seeds.end - seeds.start);
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn recordings_that_are_spoilt_at_random_are_learned_from_or_told_why_not() {
    nothing_spoilt_panics(50..75);
}

#[test]
fn recordings_that_are_spoilt_at_random_in_other_ways_are_too() {
    nothing_spoilt_panics(104..134);
}

/// 50 px of noise where 0.3 px are stated: whatever comes of it is an answer.
#[test]
fn noise_beyond_measure_is_no_reason_to_panic() {
    for seed in 0..3 {
        let truth = random_rig(6, 2, 12, seed);
        let mut recording = record(&truth, 40, seed);
        let mut normal = Normal::new(seed);
        for detection in recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels) {
            detection.pixel = detection.pixel.map(|x| x + normal.draw(50.0));
        }
        if let Ok(learned) = learn(&nothing(&truth), &recording) {
            assert!(is_finite(&learned.rig) && learned.report.rms_px > 10.0, "{} px", learned.report.rms_px);
        }
    }
}
