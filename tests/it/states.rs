//! Noisy joints, tip poses and actions: whatever a recording holds of the robot's state, the rig is learned from it.
use crate::learning::{learn, nothing};
use handeye::calibrate::{Finding, Options, calibrate, evaluate};
use handeye::recording::{Recording, Sample};
use handeye::rig::{Camera, Noise, PoseNoise, Rig};
use handeye::simulate::{SimulateOptions, Simulation, random_rig, simulate};
use handeye::solvers::Pose;
use std::ops::ControlFlow;

const SEEDS: std::ops::RangeInclusive<u64> = 1..=5;

fn noisy(seed: u64, change: impl Fn(&mut Noise)) -> Rig {
    let mut rig = random_rig(6, 2, 12, seed);
    change(&mut rig.noise);
    rig
}

fn record(rig: &Rig, samples: usize, seed: u64) -> Simulation {
    simulate(rig, &SimulateOptions { samples, seed, ..SimulateOptions::default() }).expect("the rig is in view")
}

/// Noise-free samples of the same rig.
fn fresh(rig: &Rig, seed: u64) -> Recording {
    record(rig, 100, seed + 1_000).truth
}

fn without(mut recording: Recording, forget: impl Fn(&mut Sample)) -> Recording {
    recording.samples.iter_mut().for_each(forget);
    recording
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Mean pixel distance on noise-free samples.
fn error(rig: &Rig, recording: &Recording, truth: &Recording) -> f64 {
    let learned = learn(rig, recording).expect("the recording determines the rig");
    evaluate(&learned.rig, truth).expect("the learned rig is complete").total.mean_px
}

#[test]
fn modelling_the_noise_of_joints_more_than_halves_the_error() {
    let ratio = |seed: u64| {
        let truth = noisy(seed, |noise| noise.joints = 0.02);
        let recording = record(&truth, 100, seed).recording;
        let fresh = fresh(&truth, seed);
        let mut plain = nothing(&truth);
        plain.noise.joints = 0.0;
        error(&nothing(&truth), &recording, &fresh) / error(&plain, &recording, &fresh)
    };
    let ratio = median(SEEDS.map(ratio).collect());
    assert!(ratio < 0.5, "the error with the noise modelled is {ratio} of that without");
}

#[test]
fn joint_actions_alone_determine_the_rig_with_joints_counted_from_the_first_sample() {
    let error = |seed: u64| {
        let truth = noisy(seed, |noise| noise.joint_action = 0.002);
        let Simulation { recording, truth: states, .. } = record(&truth, 60, seed);
        let recording = without(recording, |sample| (sample.joints, sample.pose) = (None, None));
        let zero = states.samples[0].joints.clone().expect("joints are simulated");
        let fresh = without(fresh(&truth, seed), |sample| {
            sample.joints.iter_mut().for_each(|joints| joints.iter_mut().zip(&zero).for_each(|(j, zero)| *j -= zero));
        });
        error(&nothing(&truth), &recording, &fresh)
    };
    let error = median(SEEDS.map(error).collect());
    assert!(error < 0.3, "{error} px without pixel noise");
}

#[test]
fn pose_actions_alone_determine_cameras_and_features_in_the_world_of_the_first_tip() {
    let error = |seed: u64| {
        let truth = noisy(seed, |noise| noise.pose_action = PoseNoise { xyz: 0.002, rot: 0.002 });
        let Simulation { recording, truth: states, .. } = record(&truth, 60, seed);
        let recording = without(recording, |sample| (sample.joints, sample.pose) = (None, None));
        let back = states.samples[0].pose.expect("poses are simulated").inverse();
        let fresh = without(fresh(&truth, seed), |sample| {
            sample.joints = None;
            sample.pose = sample.pose.map(|pose| pose * back);
        });
        error(&nothing(&truth), &recording, &fresh)
    };
    let error = median(SEEDS.map(error).collect());
    assert!(error < 0.3, "{error} px without pixel noise");
}

#[test]
fn exact_tip_poses_are_the_limit_of_noisy_ones() {
    for seed in SEEDS {
        let truth = random_rig(6, 2, 12, seed);
        let simulated = record(&truth, 50, seed);
        let fresh = without(fresh(&truth, seed), |sample| sample.joints = None);
        let with_poses = |pose: &dyn Fn(&Sample) -> Option<Pose>| {
            let mut recording = simulated.recording.clone();
            for (sample, truth) in recording.samples.iter_mut().zip(&simulated.truth.samples) {
                (sample.joints, sample.pose) = (None, pose(truth));
            }
            recording
        };
        let recording = with_poses(&|truth| truth.pose);
        let exact = error(&nothing(&truth), &recording, &fresh);
        assert!(exact < 0.1, "seed {seed}: {exact} px without pixel noise");
        let mut nearly = nothing(&truth);
        nearly.noise.pose = PoseNoise { xyz: 1e-6, rot: 1e-6 };
        let limit = error(&nearly, &recording, &fresh);
        assert!(
            (limit - exact).abs() < 1e-3,
            "seed {seed}: {limit} px for poses as good as exact, {exact} px for exact ones"
        );
    }
}

#[test]
fn samples_without_readings_take_part_where_their_images_determine_them() {
    for seed in SEEDS {
        let truth = random_rig(6, 2, 12, seed);
        let simulated = record(&truth, 60, seed);
        let mut recording = simulated.recording.clone();
        recording.samples.iter_mut().step_by(3).for_each(|sample| sample.joints = None);
        let learned = learn(&nothing(&truth), &recording).expect("two thirds have joints");
        let unknown =
            learned.report.findings.iter().filter(|found| matches!(found, Finding::UnknownState { .. })).count();
        assert!(unknown <= 4 && learned.report.samples == 60 - unknown, "seed {seed}: {:?}", learned.report.findings);
        let error = evaluate(&learned.rig, &fresh(&truth, seed)).expect("complete").total.mean_px;
        assert!(error < 0.12, "seed {seed}: {error} px without pixel noise");
    }
}

#[test]
fn a_wrong_reading_among_noisy_ones_is_named_and_let_go_of() {
    for seed in SEEDS {
        let truth = noisy(seed, |noise| noise.joints = 0.01);
        let mut recording = record(&truth, 60, seed).recording;
        let clean = error(&nothing(&truth), &recording, &fresh(&truth, seed));
        recording.samples[17].joints.as_mut().expect("joints are simulated")[2] += 0.4;
        let learned = learn(&nothing(&truth), &recording).expect("one wrong row does not matter");
        let named: Vec<usize> = learned.report.findings.iter().filter_map(wrong_sample).collect();
        assert_eq!(named, [17], "seed {seed}: {:?}", learned.report.findings);
        let spoilt = evaluate(&learned.rig, &fresh(&truth, seed)).expect("complete").total.mean_px;
        assert!(spoilt < 1.2 * clean + 0.02, "seed {seed}: {clean} px became {spoilt} px");
    }
}

fn wrong_sample(finding: &Finding) -> Option<usize> {
    if let Finding::WrongJoints { sample, .. } = finding { Some(*sample) } else { None }
}

#[test]
fn poses_beside_joints_give_the_world_and_its_unit() {
    for seed in SEEDS {
        let truth = noisy(seed, |noise| noise.pose = PoseNoise { xyz: 0.001, rot: 0.001 });
        let recording = record(&truth, 50, seed).recording;
        let mut known = nothing(&truth);
        known.estimate.fixed = ["fx", "fy", "cx", "cy"].map(|field| format!("cameras.*.{field}")).to_vec();
        let learned = learn(&known, &recording).expect("joints and poses determine the rig");
        for (camera, truth) in learned.rig.cameras.iter().zip(&truth.cameras) {
            let (learned, truth) = (camera.pose.expect("learned"), truth.pose.expect("given"));
            let apart = (learned.translation - truth.translation).norm();
            assert!(apart < 0.002 && learned.angle_to(&truth) < 0.001, "seed {seed}: {apart} m");
        }
        let error = evaluate(&learned.rig, &fresh(&truth, seed)).expect("complete").total.mean_px;
        assert!(error < 0.15, "seed {seed}: {error} px without pixel noise");
    }
}

/// Estimated over true standard deviation, by what was measured, for many recordings.
fn ratios(
    samples: usize,
    state: impl Fn(&mut Noise),
    forget: impl Fn(&mut Sample),
    parts: &[fn(&Noise) -> f64],
) -> Vec<Vec<f64>> {
    let mut ratios = vec![Vec::new(); parts.len()];
    for seed in 1..=12 {
        let truth = noisy(seed, &state);
        let recording = without(record(&truth, samples, seed).recording, &forget);
        let rig = Rig { noise: Noise { pixels: 1.0, ..Noise::default() }, ..nothing(&truth) };
        let options = Options { estimate_noise: true, ..Options::default() };
        let learned = calibrate(&rig, &recording, &options, &mut |_| ControlFlow::Continue(())).expect("enough data");
        let noise = learned.report.noise.expect("asked for");
        assert_eq!(learned.rig.noise, noise);
        for (ratios, part) in ratios.iter_mut().zip(parts) {
            ratios.push(part(&noise) / part(&truth.noise));
        }
    }
    ratios
}

/// The mean ratio is 1 within 3 standard errors of it, and no ratio is far off.
fn assert_unbiased(ratios: &[Vec<f64>], scatter: f64) {
    for (part, ratios) in ratios.iter().enumerate() {
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let far = ratios.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
        let standard_error = scatter / (ratios.len() as f64).sqrt();
        assert!((mean - 1.0).abs() < 3.0 * standard_error + 0.01 && far < 4.0 * scatter, "part {part}: {ratios:.3?}");
    }
}

// With n redundant measurements, the standard deviation of an estimated standard deviation is its 1/√(2n): here about 300.
#[test]
fn noise_of_pixels_and_joints_is_estimated_from_a_wrong_start() {
    let forget = |sample: &mut Sample| sample.pose = None;
    let ratios = ratios(60, |noise| noise.joints = 0.02, forget, &[|noise| noise.pixels, |noise| noise.joints]);
    assert_unbiased(&ratios, 0.05);
}

#[test]
fn noise_of_tip_poses_is_estimated_where_the_rig_calls_them_exact() {
    let forget = |sample: &mut Sample| sample.joints = None;
    let state = |noise: &mut Noise| noise.pose = PoseNoise { xyz: 0.003, rot: 0.006 };
    let ratios = ratios(60, state, forget, &[|n| n.pixels, |n| n.pose.xyz, |n| n.pose.rot]);
    assert_unbiased(&ratios, 0.07);
}

#[test]
fn noise_of_actions_is_estimated_where_nothing_else_is_known() {
    let forget = |sample: &mut Sample| (sample.joints, sample.pose) = (None, None);
    let joints = ratios(60, |noise| noise.joint_action = 0.01, forget, &[|n| n.pixels, |n| n.joint_action]);
    assert_unbiased(&joints, 0.05);
    let state = |noise: &mut Noise| noise.pose_action = PoseNoise { xyz: 0.004, rot: 0.008 };
    let poses = ratios(60, state, forget, &[|n| n.pixels, |n| n.pose_action.xyz, |n| n.pose_action.rot]);
    assert_unbiased(&poses, 0.07);
}

// Sums of 100 squares of normalised errors: χ² with 100 degrees of freedom is between these bounds in 998 of 1,000 cases.
#[test]
fn standard_deviations_cover_the_truth_where_the_noise_of_joints_is_known() {
    let values = |camera: &Camera| [camera.fx, camera.fy, camera.cx, camera.cy].map(|value| value.expect("known"));
    let mut squares = [0.0; 8];
    for seed in 1..=100 {
        let truth = noisy(seed, |noise| noise.joints = 0.02);
        let mut rig = nothing(&truth);
        // The header holds the true values, around which a prior would make the errors too small.
        rig.estimate.prior.insert("cameras".to_owned(), 1e4);
        rig.cameras = truth.cameras.iter().map(|camera| Camera { pose: None, ..camera.clone() }).collect();
        let learned = learn(&rig, &record(&truth, 50, seed).recording).expect("enough data").rig;
        let sd = &learned.fit.as_ref().expect("learned").sd;
        for (index, (learned, truth)) in learned.cameras.iter().zip(&truth.cameras).enumerate() {
            let errors = values(learned).into_iter().zip(values(truth)).map(|(learned, truth)| learned - truth);
            for (place, (field, error)) in ["fx", "fy", "cx", "cy"].into_iter().zip(errors).enumerate() {
                squares[4 * index + place] += (error / sd[&format!("cameras.{}.{field}", truth.name)][0]).powi(2);
            }
        }
    }
    assert!(squares.iter().all(|sum| (61.9..149.5).contains(sum)), "{squares:.1?}");
}

/// Joints that were read exactly have no noise, which the estimation finds in the end and says so.
#[test]
fn the_noise_of_exact_readings_is_found_to_be_none() {
    let truth = noisy(1, |_| ());
    let recording = record(&truth, 60, 1).recording;
    let options = Options { estimate_noise: true, ..Options::default() };
    let learned = calibrate(&nothing(&truth), &recording, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let noise = learned.report.noise.unwrap();
    assert!(learned.report.converged && noise.joints < 5e-5, "{noise:?}");
    assert!((noise.pixels / truth.noise.pixels - 1.0).abs() < 0.1, "{noise:?}");
}
