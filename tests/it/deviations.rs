//! Standard deviations are honest: learned numbers are as far from the truth as they say, on average.
//!
//! Where they are honest, (learned - true)²/sd² has a mean of 1. The numbers of one rig are not independent, but their means
//! are from seed to seed: 3 standard errors of those bound the mean of the means.
use crate::learning::{Normal, learn, nothing, pixel_noise, record};
use handeye::recording::Recording;
use handeye::rig::{Estimate, Model, Parameter, Rig};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use std::collections::BTreeMap;

const SEEDS: u64 = 60;
const NOISY_SEEDS: u64 = 30;

/// Values of a parameter: of a pose the difference to that of another rig (as a step), of an angle within a half turn of 0.
fn differences(parameter: &Parameter, learned: &Rig, truth: &Rig) -> Vec<f64> {
    let pose = |learned: Option<Pose>, truth: Option<Pose>| -> Vec<f64> {
        let (learned, truth) = (learned.unwrap(), truth.unwrap());
        let turned = so3::log(&(learned.rotation * truth.rotation.transpose()));
        (learned.translation - truth.translation).iter().chain(turned.iter()).copied().collect()
    };
    match *parameter {
        Parameter::Base => pose(learned.robot.base, truth.robot.base),
        Parameter::JointField { joint, field } => {
            let value = |rig: &Rig| field.value(&rig.robot.joints[joint]).unwrap_or(0.0);
            let difference = value(learned) - value(truth);
            let is_angle = !matches!(field.name(), "d" | "a");
            let turn = std::f64::consts::TAU;
            vec![if is_angle { difference - turn * (difference / turn).round() } else { difference }]
        }
        Parameter::CameraPose(camera) => pose(learned.cameras[camera].pose, truth.cameras[camera].pose),
        Parameter::CameraField { camera, field } => {
            let value = |rig: &Rig| match field.name() {
                "fx" => rig.cameras[camera].fx.unwrap(),
                "fy" => rig.cameras[camera].fy.unwrap(),
                "cx" => rig.cameras[camera].cx.unwrap(),
                _ => rig.cameras[camera].cy.unwrap(),
            };
            vec![value(learned) - value(truth)]
        }
        Parameter::TargetPose(target) => pose(learned.targets[target].pose, truth.targets[target].pose),
        Parameter::FeatureXyz(feature) => {
            let [learned, truth] = [learned, truth].map(|rig| rig.features[feature].xyz.unwrap());
            learned.iter().zip(truth).map(|(learned, truth)| learned - truth).collect()
        }
    }
}

/// ((learned - true)/sd)² of every learned number, by path.
fn squares(learned: &Rig, truth: &Rig) -> BTreeMap<String, f64> {
    let sds = &learned.fit.as_ref().unwrap().sd;
    let mut squares = BTreeMap::new();
    for parameter in learned.parameters() {
        let path = parameter.path(learned);
        let Some(sds) = sds.get(&path) else { continue };
        let differences = differences(&parameter, learned, truth);
        assert_eq!(sds.len(), differences.len(), "{path}");
        for (index, (difference, sd)) in differences.iter().zip(sds).enumerate() {
            assert!(*sd > 0.0, "{path}: a standard deviation of {sd}");
            squares.insert(format!("{path}[{index}]"), (difference / sd).powi(2));
        }
    }
    squares
}

/// Mean of the means that seeds give, and its standard error.
fn mean_of(means: &[f64]) -> (f64, f64) {
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

fn mean(squares: &BTreeMap<String, f64>) -> f64 {
    squares.values().sum::<f64>() / squares.len() as f64
}

/// The mean square is 1 within 3 standard errors.
fn is_honest(means: &[f64], what: &str) {
    let (mean, error) = mean_of(means);
    println!("{what}: mean square {mean:.3} ± {error:.3}");
    assert!((1.0 - 3.0 * error..1.0 + 3.0 * error).contains(&mean), "{what}: mean square {mean:.3} ± {error:.3}");
}

/// Every number of the rig is known as well as its prior says, and no better.
fn roughly_known(truth: &Rig, seed: u64) -> Rig {
    let (angle, length) = (0.01, 0.005);
    let mut normal = Normal::new(seed);
    let mut rig = truth.clone();
    for joint in &mut rig.robot.joints {
        for (value, sd) in
            [(&mut joint.offset, angle), (&mut joint.d, length), (&mut joint.a, length), (&mut joint.alpha, angle)]
        {
            *value = value.map(|value| value + normal.draw(sd));
        }
    }
    for camera in &mut rig.cameras {
        camera.pose = camera.pose.map(|pose| normal.move_pose(&pose, 0.01, 0.01));
        for value in [&mut camera.fx, &mut camera.fy, &mut camera.cx, &mut camera.cy].into_iter().flatten() {
            *value += normal.draw(5.0);
        }
    }
    for feature in &mut rig.features {
        feature.xyz = feature.xyz.map(|xyz| xyz.map(|x| x + normal.draw(length)));
    }
    let mut prior = BTreeMap::from([("features".to_owned(), length), ("cameras.*.pose".to_owned(), 0.01)]);
    for (names, field, sd) in [
        ("robot.joints", "offset", angle),
        ("robot.joints", "alpha", angle),
        ("robot.joints", "d", length),
        ("robot.joints", "a", length),
        ("cameras", "fx", 5.0),
        ("cameras", "fy", 5.0),
        ("cameras", "cx", 5.0),
        ("cameras", "cy", 5.0),
    ] {
        prior.insert(format!("{names}.*.{field}"), sd);
    }
    rig.estimate = Estimate { fixed: vec!["robot.base".to_owned()], prior, ..Estimate::default() };
    rig
}

#[test]
fn of_what_is_roughly_known_beforehand() {
    let run = |seed| {
        let truth = random_rig(6, 2, 12, seed);
        let learned = learn(&roughly_known(&truth, seed), &record(&truth, 20, seed)).unwrap().rig;
        mean(&squares(&learned, &truth))
    };
    is_honest(&(0..SEEDS).map(run).collect::<Vec<_>>(), "roughly known");
}

/// With the cameras' poses given, everything is metric and has one place. Rows of the first and the last joint depend on
/// where the gauge puts base and tip; those between, and what leads from the first axis to the second, do not.
#[test]
fn of_a_chain_that_is_learned_before_known_cameras() {
    let run = |seed| {
        let truth = random_rig(6, 2, 12, seed);
        let learned = learn(&cameras_known(&truth), &record(&truth, 40, seed)).unwrap().rig;
        mean(&inner_rows(squares(&learned, &truth)))
    };
    is_honest(&(0..SEEDS).map(run).collect::<Vec<_>>(), "chain");
}

fn cameras_known(truth: &Rig) -> Rig {
    let estimate = Estimate { fixed: vec!["cameras".to_owned()], ..Estimate::default() };
    Rig { cameras: truth.cameras.clone(), estimate, ..nothing(truth) }
}

/// Those of joints 2 to 5, and of the length and the twist of the first.
fn inner_rows(mut squares: BTreeMap<String, f64>) -> BTreeMap<String, f64> {
    let inside = ["j1.a", "j2.", "j3.", "j4.", "j5."].map(|row| format!("robot.joints.{row}"));
    squares.retain(|path, _| inside.iter().any(|row| path.starts_with(row)));
    assert_eq!(squares.len(), 2 + 4 * 4);
    squares
}

/// The same motions with other noise every time: the tip is as far off on average as its deviation says.
#[test]
fn of_the_tip() {
    let truth = random_rig(6, 2, 12, 3);
    let exact = simulate(&truth, &SimulateOptions { samples: 40, ..SimulateOptions::default() }).unwrap().truth;
    let mut start = truth.clone();
    // What would be redundant is held at its true value; nothing else is known any well.
    start.estimate.fixed =
        ["robot.base", "cameras.*.pose", "robot.joints.j1.offset", "robot.joints.j1.d", "robot.joints.j6"]
            .map(str::to_owned)
            .into();
    start.estimate.prior = [("robot", 10.0), ("features", 10.0)].map(|(path, sd)| (path.to_owned(), sd)).into();
    let joints: Vec<&Vec<f64>> = exact.samples.iter().flat_map(|sample| &sample.joints).collect();
    let tips = |rig: &Rig| -> Vec<_> {
        let model = Model::new(rig).unwrap();
        joints.iter().map(|joints| model.tip(joints).translation).collect()
    };
    let true_tips = tips(&truth);
    let (mut squares, mut medians, mut largest) = (vec![0.0; joints.len()], Vec::new(), Vec::new());
    for seed in 0..SEEDS {
        let mut normal = Normal::new(seed);
        let mut recording: Recording = exact.clone();
        for detection in recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels) {
            detection.pixel = detection.pixel.map(|x| x + normal.draw(truth.noise.pixels));
        }
        let learned = learn(&start, &recording).unwrap();
        let deviation = learned.report.tip.unwrap();
        assert!(deviation.metric && deviation.median <= deviation.largest);
        medians.push(deviation.median);
        largest.push(deviation.largest);
        for (square, (tip, true_tip)) in squares.iter_mut().zip(tips(&learned.rig).iter().zip(&true_tips)) {
            *square += (tip - true_tip).norm_squared() / SEEDS as f64;
        }
    }
    squares.sort_by(f64::total_cmp);
    let actual = [squares[squares.len() / 2], squares[squares.len() - 1]].map(f64::sqrt);
    // A root mean square of n is off by 1/√(2n), or less where a number has more than one coordinate.
    let bound = 3.0 / (2.0 * SEEDS as f64).sqrt();
    for (actual, (said, what)) in actual.into_iter().zip([(medians, "median"), (largest, "largest")]) {
        let (said, _) = mean_of(&said);
        println!("tip, {what}: {:.4} mm, {:.4} mm said", 1e3 * actual, 1e3 * said);
        assert!((actual / said - 1.0).abs() < bound, "{what}: {actual:.6} m, {said:.6} m said");
    }
}

/// Where the images are noisier than is said, the deviations grow with what is left over.
#[test]
fn where_the_noise_is_larger_than_stated() {
    let run = |seed| {
        let mut truth = random_rig(6, 2, 12, seed);
        truth.noise = pixel_noise(0.9);
        let recording = record(&truth, 40, seed);
        let start = Rig { noise: pixel_noise(0.3), ..cameras_known(&truth) };
        mean(&inner_rows(squares(&learn(&start, &recording).unwrap().rig, &truth)))
    };
    let (mean, error) = mean_of(&(0..SEEDS).map(run).collect::<Vec<_>>());
    println!("noise three times as large: mean square {mean:.3} ± {error:.3}");
    assert!((1.0 - 3.0 * error..1.0 + 3.0 * error).contains(&mean), "mean square {mean:.3} ± {error:.3}");
}

/// The same where joints are read with noise: what is said is the rig's deviation at given joints, not that of the states.
#[test]
fn of_the_tip_where_joints_are_noisy() {
    let mut truth = random_rig(6, 2, 12, 3);
    truth.noise.joints = 0.01;
    let mut start = truth.clone();
    start.estimate.fixed =
        ["robot.base", "cameras.*.pose", "robot.joints.j1.offset", "robot.joints.j1.d", "robot.joints.j6"]
            .map(str::to_owned)
            .into();
    start.estimate.prior = [("robot", 10.0), ("features", 10.0)].map(|(path, sd)| (path.to_owned(), sd)).into();
    let exact = simulate(&truth, &SimulateOptions { samples: 40, ..SimulateOptions::default() }).unwrap().truth;
    let tips = |rig: &Rig| -> Vec<_> {
        let model = Model::new(rig).unwrap();
        let joints = exact.samples.iter().flat_map(|sample| &sample.joints);
        joints.map(|joints| model.tip(joints).translation).collect()
    };
    let true_tips = tips(&truth);
    let (mut squares, mut medians) = (vec![0.0; true_tips.len()], Vec::new());
    for seed in 0..NOISY_SEEDS {
        let mut normal = Normal::new(seed);
        let mut recording = exact.clone();
        for sample in &mut recording.samples {
            sample.joints.iter_mut().flatten().for_each(|joint| *joint += normal.draw(truth.noise.joints));
            for detection in &mut sample.pixels {
                detection.pixel = detection.pixel.map(|x| x + normal.draw(truth.noise.pixels));
            }
        }
        let learned = learn(&start, &recording).unwrap();
        medians.push(learned.report.tip.unwrap().median);
        for (square, (tip, true_tip)) in squares.iter_mut().zip(tips(&learned.rig).iter().zip(&true_tips)) {
            *square += (tip - true_tip).norm_squared() / NOISY_SEEDS as f64;
        }
    }
    squares.sort_by(f64::total_cmp);
    let (actual, (said, _)) = (squares[squares.len() / 2].sqrt(), mean_of(&medians));
    println!("tip, noisy joints: {:.4} mm, {:.4} mm said", 1e3 * actual, 1e3 * said);
    let bound = 3.0 / (2.0 * NOISY_SEEDS as f64).sqrt();
    assert!((actual / said - 1.0).abs() < bound, "{actual:.6} m, {said:.6} m said");
}
