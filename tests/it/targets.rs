//! Cameras and targets are learned from poses of targets, with the images' clock and the scale, and what is open is said.
use crate::cli::Folder;
use handeye::calibrate::{Calibration, Options, calibrate};
use handeye::recording::{RecordedCamera, Recording, Sample, TargetDetection};
use handeye::report::{Subject, html};
use handeye::rig::{Camera, Model, Parent, PoseNoise, Rig};
use handeye::solvers::Pose;
use nalgebra::{Matrix6, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::ops::ControlFlow;

/// What is true of a simulated recording.
struct World {
    camera: Pose,
    target: Pose,
    on_hand: bool,
}

/// How a recording is spoilt.
#[derive(Clone, Copy, Default)]
struct Spoilt {
    robot: PoseNoise,
    target: PoseNoise,
    scale: Option<f64>,
    /// Share of detections that are anything.
    wrong: f64,
}

fn noise(random: &mut ChaCha8Rng, noise: PoseNoise) -> Pose {
    let mut vector = |sd: f64| Vector3::from_fn(|_, _| sd * Distribution::<f64>::sample(&StandardNormal, random));
    Pose::new(vector(noise.rot), vector(noise.xyz))
}

fn pose(random: &mut ChaCha8Rng, turn: f64, length: f64) -> Pose {
    let mut vector = |size: f64| Vector3::from_fn(|_, _| random.random_range(-size..size));
    Pose::new(vector(turn), vector(length))
}

fn world(random: &mut ChaCha8Rng, on_hand: bool) -> World {
    let (near, far) = (pose(random, 1.0, 0.1), pose(random, 1.5, 1.0));
    if on_hand { World { camera: near, target: far, on_hand } } else { World { camera: far, target: near, on_hand } }
}

impl World {
    fn seen(&self, tip: &Pose) -> Pose {
        let (mount, carrier) = if self.on_hand { (*tip, Pose::identity()) } else { (Pose::identity(), *tip) };
        (mount * self.camera).inverse() * carrier * self.target
    }

    fn sample(&self, random: &mut ChaCha8Rng, tip: Pose, spoilt: Spoilt) -> Sample {
        let mut seen = self.seen(&tip);
        if random.random_bool(spoilt.wrong) {
            seen = pose(random, 2.0, 1.0);
        }
        seen.translation *= spoilt.scale.unwrap_or(1.0);
        let error = noise(random, spoilt.target);
        let seen = Pose { rotation: seen.rotation * error.rotation, translation: seen.translation + error.translation };
        let targets = vec![TargetDetection { camera: 0, target: "tag".into(), pose: seen, covariance: None }];
        Sample { pose: Some(tip * noise(random, spoilt.robot)), targets, ..Sample::default() }
    }

    fn rig(&self) -> Rig {
        let parent = if self.on_hand { Parent::Tip } else { Parent::World };
        Rig { cameras: vec![Camera { name: "camera".into(), parent, ..Camera::default() }], ..Rig::default() }
    }
}

fn recording(samples: Vec<Sample>) -> Recording {
    let camera = RecordedCamera { name: "camera".into(), ..RecordedCamera::default() };
    Recording { cameras: vec![camera], samples, ..Recording::default() }
}

fn learn(rig: &Rig, recording: &Recording) -> Calibration {
    calibrate(rig, recording, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Errors of camera and target [rad, m].
fn errors(learned: &Rig, world: &World) -> [f64; 4] {
    let (camera, target) = (learned.cameras[0].pose.unwrap(), learned.targets[0].pose.unwrap());
    let off = |found: &Pose, truth: &Pose| (found.angle_to(truth), (found.translation - truth.translation).norm());
    let ((a, b), (c, d)) = (off(&camera, &world.camera), off(&target, &world.target));
    [a, b, c, d]
}

#[test]
fn exact_poses_give_the_exact_camera_and_target_on_the_hand_or_in_the_world() {
    for seed in 0..10 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let world = world(&mut random, seed % 2 == 0);
        let scale = (seed % 3 == 0).then_some(2.5);
        let spoilt = Spoilt { scale, ..Spoilt::default() };
        let samples = (0..8)
            .map(|_| {
                let tip = pose(&mut random, 1.0, 0.5);
                world.sample(&mut random, tip, spoilt)
            })
            .collect();
        let learned = learn(&world.rig(), &recording(samples));
        let errors = errors(&learned.rig, &world);
        assert!(errors.iter().all(|error| *error < 1e-5), "seed {seed}: {errors:?}");
        let report = learned.report.targets.unwrap();
        assert_eq!(report.scale.is_some(), scale.is_some(), "seed {seed}");
        assert!(learned.report.gauge.is_empty() && learned.report.converged);
        let text = learned.rig.to_toml();
        assert_eq!(Rig::parse(&text, "learned.toml").unwrap().targets.len(), 1, "a learned rig is a rig file");
    }
}

/// However few the poses are, their noise alone makes no scale; where there is one, a dozen show it.
#[test]
fn a_scale_is_found_where_there_is_one_and_not_in_the_noise_of_a_few_poses() {
    let target = PoseNoise { xyz: 0.002, rot: 0.002 };
    let with_scale = |poses: usize, scale: Option<f64>| {
        let is_found = |seed: &u64| {
            let mut random = ChaCha8Rng::seed_from_u64(*seed);
            let world = world(&mut random, seed.is_multiple_of(2));
            let tips: Vec<Pose> = (0..poses).map(|_| pose(&mut random, 1.0, 0.3)).collect();
            let spoilt = Spoilt { target, scale, ..Spoilt::default() };
            let samples = tips.into_iter().map(|tip| world.sample(&mut random, tip, spoilt)).collect();
            learn(&world.rig(), &recording(samples)).report.targets.unwrap().scale.is_some()
        };
        (0..100).filter(is_found).count()
    };
    for poses in [3, 4, 5, 8, 20] {
        let alarms = with_scale(poses, None);
        assert!(alarms <= 1, "{poses} poses: {alarms} of 100");
    }
    let found = with_scale(12, Some(1.3));
    assert!(found >= 99, "{found} of 100");
}

// Normalised squared errors of the camera's six numbers are χ² with 6 degrees of freedom: over 40 seeds the sum has mean 240 and
// standard deviation 22.
#[test]
fn stated_noise_of_robot_and_targets_gives_honest_standard_deviations() {
    let spoilt = Spoilt {
        robot: PoseNoise { xyz: 0.001, rot: 0.002 },
        target: PoseNoise { xyz: 0.002, rot: 0.004 },
        ..Spoilt::default()
    };
    let mut sum = 0.0;
    for seed in 0..40 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let world = world(&mut random, seed % 2 == 0);
        let samples = (0..20)
            .map(|_| {
                let tip = pose(&mut random, 1.0, 0.3);
                world.sample(&mut random, tip, spoilt)
            })
            .collect();
        let mut rig = world.rig();
        (rig.noise.pose, rig.noise.target) = (spoilt.robot, Some(spoilt.target));
        let learned = learn(&rig, &recording(samples)).rig;
        let sd = &learned.fit.as_ref().unwrap().sd["cameras.camera.pose"];
        let (found, truth) = (learned.cameras[0].pose.unwrap(), world.camera);
        let turn = handeye::solvers::manifold::so3::log(&(found.rotation * truth.rotation.transpose()));
        let step = (found.translation - truth.translation).iter().chain(turn.iter()).copied().collect::<Vec<_>>();
        sum += step.iter().zip(sd).map(|(error, sd)| (error / sd).powi(2)).sum::<f64>();
    }
    // Coordinates are correlated, which widens the spread of the sum but not its mean.
    assert!((120.0..400.0).contains(&sum), "{sum}");
}

/// What a fit takes up of the noise is missing in its residuals, of 8 views a quarter of the variance: deviations say it all the same.
#[test]
fn noise_that_is_not_stated_is_not_taken_for_less_where_views_are_few() {
    let target = PoseNoise { xyz: 0.002, rot: 0.004 };
    let (mut logs, mut n) = (0.0, 0.0);
    for seed in 0..100 {
        let mut random = ChaCha8Rng::seed_from_u64(900 + seed);
        let world = world(&mut random, seed % 2 == 0);
        let samples = (0..8)
            .map(|_| {
                let tip = pose(&mut random, 1.0, 0.3);
                world.sample(&mut random, tip, Spoilt { target, ..Spoilt::default() })
            })
            .collect();
        let (recording, mut rig) = (recording(samples), world.rig());
        let sds = |rig: &Rig| learn(rig, &recording).rig.fit.unwrap().sd["cameras.camera.pose"].clone();
        let estimated = sds(&rig);
        rig.noise.target = Some(target);
        for (estimated, stated) in estimated.iter().zip(sds(&rig)) {
            logs += (estimated / stated).ln();
            n += 1.0;
        }
    }
    let ratio = f64::exp(logs / n);
    assert!((0.93..1.07).contains(&ratio), "deviations are {ratio} times those of the true noise");
}

/// Medians over the seeds of the camera's error of place [m], with the covariances of detections passed on and without.
fn with_and_without_covariances(seeds: u64) -> [f64; 2] {
    let mut found: [Vec<f64>; 2] = Default::default();
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(500 + seed);
        let world = world(&mut random, seed % 2 == 0);
        let mut samples: Vec<Sample> = Vec::new();
        for k in 0..20 {
            // Errors of place and rotation go together, along directions of each detection's own; some are far away.
            let size = if k % 2 == 0 { 0.001 } else { 0.008 };
            let mix = Matrix6::from_fn(|_, _| size * random.random_range(-1.0..1.0)) + Matrix6::identity() * 0.0002;
            let tip = pose(&mut random, 1.0, 0.3);
            let mut sample = world.sample(&mut random, tip, Spoilt::default());
            let error = mix * Vector6::from_fn(|_, _| Distribution::<f64>::sample(&StandardNormal, &mut random));
            let (step, turn) = (error.fixed_rows::<3>(0).into_owned(), error.fixed_rows::<3>(3).into_owned());
            let seen = &mut sample.targets[0];
            seen.pose.translation += step;
            seen.pose.rotation = Pose::new(turn, Vector3::zeros()).rotation * seen.pose.rotation;
            seen.covariance = Some(mix * mix.transpose());
            samples.push(sample);
        }
        found[0].push(errors(&learn(&world.rig(), &recording(samples.clone())).rig, &world)[1]);
        samples.iter_mut().for_each(|sample| sample.targets[0].covariance = None);
        found[1].push(errors(&learn(&world.rig(), &recording(samples)).rig, &world)[1]);
    }
    found.map(|mut errors| {
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    })
}

#[test]
fn covariances_of_detections_weigh_them_direction_by_direction() {
    let [with, without] = with_and_without_covariances(20);
    assert!(with < 0.5 * without, "{with} m with covariances, {without} m without");
}

/// A UR5 with a camera on its hand, its nominal rows given.
fn arm() -> Rig {
    let mut rig = Rig::parse(include_str!("../../models/ur5.toml"), "ur5.toml").unwrap();
    rig.cameras = vec![Camera { name: "camera".into(), parent: Parent::Tip, ..Camera::default() }];
    rig.features.clear();
    rig.targets.clear();
    rig
}

// The target is predicted in new poses: chain and camera together, so that what one takes from the other does not count.
#[test]
fn a_chain_that_is_off_is_learned_and_one_that_is_right_is_left_alone() {
    for (off, most) in [(0.003, 0.4), (0.0, 1.6)] {
        let mut ratios = Vec::new();
        for seed in 0..7 {
            let mut random = ChaCha8Rng::seed_from_u64(900 + seed);
            let world = world(&mut random, true);
            let nominal = arm();
            let mut built = nominal.clone();
            for joint in &mut built.robot.joints {
                let mut moved = |value: Option<f64>| value.map(|value| value + random.random_range(-off..=off));
                (joint.offset, joint.d, joint.a, joint.alpha) =
                    (moved(joint.offset), moved(joint.d), moved(joint.a), moved(joint.alpha));
            }
            let model = |rig: &Rig| Model::new(&Rig { robot: rig.robot.clone(), ..Rig::default() }).unwrap();
            let truth = model(&built);
            let spoilt = Spoilt { target: PoseNoise { xyz: 0.0005, rot: 0.001 }, ..Spoilt::default() };
            let mut joints = || (0..6).map(|_| random.random_range(-1.5..1.5)).collect::<Vec<f64>>();
            let (seen, new): (Vec<_>, Vec<_>) =
                ((0..60).map(|_| joints()).collect(), (0..30).map(|_| joints()).collect());
            let samples: Vec<Sample> = seen
                .iter()
                .map(|q| Sample {
                    pose: None,
                    joints: Some(q.clone()),
                    ..world.sample(&mut random, truth.tip(q), spoilt)
                })
                .collect();
            let recording = Recording { joints: (1..=6).map(|k| format!("j{k}")).collect(), ..recording(samples) };
            let error = |rig: &Rig| {
                let learned = learn(rig, &recording).rig;
                let chain = model(&learned);
                let (camera, target) = (learned.cameras[0].pose.unwrap(), learned.targets[0].pose.unwrap());
                let off = |q: &Vec<f64>| {
                    let found = (chain.tip(q) * camera).inverse() * target;
                    (found.translation - world.seen(&truth.tip(q)).translation).norm_squared()
                };
                (new.iter().map(off).sum::<f64>() / new.len() as f64).sqrt()
            };
            let mut held = nominal.clone();
            held.estimate.fixed = vec!["robot".into()];
            ratios.push(error(&nominal) / error(&held));
        }
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[3] < most, "off by {off}: {ratios:?} of the error with the chain held");
    }
}

#[test]
fn three_wrong_detections_in_ten_spoil_nothing_and_are_left_out() {
    for seed in 0..10 {
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed);
        let world = world(&mut random, seed % 2 == 0);
        let target = PoseNoise { xyz: 0.001, rot: 0.002 };
        let spoilt = Spoilt { target, wrong: 0.3, ..Spoilt::default() };
        let samples = (0..40)
            .map(|_| {
                let tip = pose(&mut random, 1.0, 0.3);
                world.sample(&mut random, tip, spoilt)
            })
            .collect();
        let learned = learn(&world.rig(), &recording(samples));
        let errors = errors(&learned.rig, &world);
        assert!(errors.iter().all(|error| *error < 0.005), "seed {seed}: {errors:?}");
        assert!(learned.report.rejected >= 3, "seed {seed}: {}", learned.report.rejected);
    }
}

#[test]
fn turns_about_one_axis_are_reported_with_that_axis() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let world = world(&mut random, true);
    let axis = Vector3::new(0.6, 0.0, 0.8);
    let target = PoseNoise { xyz: 0.001, rot: 0.001 };
    let samples = (0..20).map(|k| {
        let tip = Pose::new(axis * (0.1 * f64::from(k)), pose(&mut random, 1.0, 0.3).translation);
        world.sample(&mut random, tip, Spoilt { target, ..Spoilt::default() })
    });
    let samples = samples.collect();
    let gauge = learn(&world.rig(), &recording(samples)).report.gauge;
    assert!(
        gauge.iter().any(|line| line.contains("one axis") && line.contains("0.600") && line.contains("0.800")),
        "{gauge:?}"
    );
}

// Visual odometry: what is reported is the camera's pose since the first image, with every error that was made on the way. Normalised
// squared errors are χ² with 6 degrees of freedom: over 12 seeds the sum has mean 72 and standard deviation 12, and fifty times as much
// where errors are taken for independent.
#[test]
fn poses_that_drift_are_weighed_by_what_is_new_in_each() {
    let step = PoseNoise { xyz: 0.002, rot: 0.001 };
    let mut sum = 0.0;
    for seed in 0..12 {
        let mut random = ChaCha8Rng::seed_from_u64(300 + seed);
        let world = world(&mut random, true);
        let phase: [f64; 6] = std::array::from_fn(|_| random.random_range(0.0..6.0));
        let tip = |t: f64| {
            let wave = |k: usize| ((0.2 + 0.05 * k as f64) * std::f64::consts::TAU * t + phase[k]).sin();
            Pose::new(0.5 * Vector3::from_fn(|k, _| wave(k)), 0.3 * Vector3::from_fn(|k, _| wave(3 + k)))
        };
        let (mut drift, mut samples) = (Pose::identity(), Vec::new());
        for k in 0..100 {
            let tip = tip(f64::from(k) / 15.0);
            let mut sample = world.sample(&mut random, tip, Spoilt::default());
            let seen = world.seen(&tip);
            drift = seen.inverse() * noise(&mut random, step) * seen * drift;
            sample.targets[0].pose = seen * drift;
            samples.push(sample);
        }
        let learned = learn(&world.rig(), &recording(samples));
        assert!(learned.report.states[0].contains("drift"), "seed {seed}: {:?}", learned.report.states);
        let sd = &learned.rig.fit.as_ref().unwrap().sd["cameras.camera.pose"];
        let (found, truth) = (learned.rig.cameras[0].pose.unwrap(), world.camera);
        let turn = handeye::solvers::manifold::so3::log(&(found.rotation * truth.rotation.transpose()));
        let step = (found.translation - truth.translation).iter().chain(turn.iter()).copied().collect::<Vec<_>>();
        sum += step.iter().zip(sd).map(|(error, sd)| (error / sd).powi(2)).sum::<f64>();
    }
    assert!((36.0..140.0).contains(&sum), "{sum}");
}

#[test]
fn a_clock_that_is_ahead_is_found_where_robot_and_images_were_recorded_apart() {
    for seed in 0..4 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let world = world(&mut random, seed % 2 == 0);
        let target = PoseNoise { xyz: 0.001, rot: 0.002 };
        let ahead = 0.04 * (seed as f64 - 1.5);
        let tip = |t: f64| {
            let wave = |f: f64, p: f64| (std::f64::consts::TAU * f * t + p).sin();
            let turn = Vector3::new(0.5 * wave(0.31, 0.0), 0.4 * wave(0.43, 1.0), 0.6 * wave(0.23, 2.0));
            Pose::new(turn, Vector3::new(0.2 * wave(0.27, 0.5), 0.2 * wave(0.37, 1.5), 0.1 * wave(0.53, 2.5)))
        };
        let mut samples: Vec<Sample> = Vec::new();
        for k in 0..1000 {
            let time = 0.008 * f64::from(k);
            let pose = tip(time) * noise(&mut random, PoseNoise { xyz: 0.0003, rot: 0.0005 });
            samples.push(Sample { time: Some(time), pose: Some(pose), ..Sample::default() });
        }
        for k in 0..220 {
            let time = 0.3 + 0.033 * f64::from(k);
            let image = world.sample(&mut random, tip(time), Spoilt { target, ..Spoilt::default() });
            samples.push(Sample { time: Some(time + ahead), pose: None, ..image });
        }
        samples.sort_by(|a, b| a.time.partial_cmp(&b.time).unwrap());
        let recording = recording(samples);
        let learned = learn(&world.rig(), &recording);
        let (offset, sd) = learned.report.targets.as_ref().unwrap().time_offset.unwrap();
        let (about, before) = ("clocks".into(), &world.rig());
        let calibration = &learned;
        let page = html(&Subject { about, before, calibration, recording: &recording, suggestion: None, tables: &[] });
        let words = format!("the images' clock is {:.2} ms ahead of the robot's (± {:.2} ms)", 1e3 * offset, 1e3 * sd);
        assert!(page.unwrap().contains(&words), "{words}");
        assert!((offset - ahead).abs() < 5.0 * sd && sd < 1e-3, "seed {seed}: {offset} ± {sd}, true {ahead}");
        let errors = errors(&learned.rig, &world);
        assert!(errors.iter().all(|error| *error < 0.003), "seed {seed}: {errors:?}");
    }
}

/// A hand-eye calibration as most are recorded: poses of the robot and of a board, joints besides, and nothing of a lens.
#[test]
fn a_page_needs_no_lens_and_the_rig_is_written() {
    let folder = Folder::new("targets-page");
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let world = world(&mut random, true);
    let spoilt = Spoilt { target: PoseNoise { xyz: 0.001, rot: 0.001 }, ..Spoilt::default() };
    let mut samples: Vec<Sample> = Vec::new();
    for _ in 0..15 {
        let tip = pose(&mut random, 0.8, 0.3);
        samples.push(world.sample(&mut random, tip, spoilt));
    }
    let mut recording = recording(samples);
    let are_written = |recording: &Recording| {
        recording.write(&folder.path().join("poses.jsonl")).unwrap();
        world.rig().write(&folder.path().join("rig.toml"), None).unwrap();
        let (said, _) = folder.expect(0, "calibrate poses.jsonl --rig rig.toml -o learned.toml --report page.html");
        assert!(said.starts_with("learned 1 camera pose, 1 target from"), "{said}");
        let learned = Rig::parse(&folder.read("learned.toml"), "learned.toml").unwrap();
        assert!(errors(&learned, &world).iter().all(|error| *error < 0.003));
        let page = folder.read("page.html");
        assert!(page.contains("<h2>Where everything is</h2>") && page.contains("\"name\":\"camera\""));
        assert!(!page.contains("handeye evaluate") && !said.contains("handeye evaluate"), "nothing can be predicted");
    };
    are_written(&recording);
    recording.joints = vec!["a".to_owned(), "b".to_owned()];
    recording.samples.iter_mut().for_each(|sample| sample.joints = Some(vec![0.1, 0.2]));
    are_written(&recording);
}
