//! Image-based and pose-based servoing with features missing, limits, depths, rigs that are off, and nonsense.
use crate::learning::variants;
use crate::servo::{look, mean_error, moved, positions};
use crate::visual_servo::{KINDS, Servo, start_and_target};
use handeye::camera::CameraModel;
use handeye::infer::Sighting;
use handeye::rig::Feature;
use handeye::servo::limits::InImage;
use handeye::servo::{Arm, Configuration, Depth, Gain, ImageBased, ImageSettings, InteractionMatrix, Limit};
use handeye::simulate::random_rig;
use handeye::solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn it_goes_on_with_what_is_left_of_the_features_and_says_when_nothing_is() {
    for seed in 0..20 {
        let rig = if seed % 2 == 0 { random_rig(6, 2, 12, seed) } else { variants::on_hand(2, seed) };
        let arm = Arm::new(&rig).unwrap();
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let (start, target) = start_and_target(&rig, 0.25, seed);
        let goal = look(&arm, &rig, &target);
        for mut servo in Servo::defaults(&rig) {
            servo.aim(&goal);
            let mut joints = start.clone();
            for _ in 0..10 {
                let mut seen = look(&arm, &rig, &joints);
                seen.retain(|_| random.random_bool(0.5));
                let (pixel, other) = ([f64::NAN, 3.0], [100.0, 100.0]);
                seen.insert(0, Sighting { camera: 0, feature: 99, pixel: other });
                seen.push(Sighting { camera: 7, feature: 0, pixel: other });
                if let Some(one) = seen.get_mut(1) {
                    one.pixel = pixel;
                }
                let step = servo.step(&seen, &joints, &[], 100.0).unwrap();
                moved(&mut joints, &step.motion);
            }
            let error = mean_error(&look(&arm, &rig, &joints), &goal);
            assert!(error < 0.01, "seed {seed}: {}, {error} px", servo.name());
            let nothing = servo.step(&[], &joints, &[], 1.0).unwrap_err();
            let expected = match servo {
                Servo::Image(_) => "none of the 24 features aimed at is seen",
                Servo::Pose(_) => "the pixels seen leave the tip's pose open",
            };
            assert_eq!(nothing.to_string(), expected);
            let seen = look(&arm, &rig, &joints);
            let short = servo.step(&seen, &joints[1..], &[], 1.0).unwrap_err();
            assert_eq!(short.to_string(), "5 joint readings; the rig has 6 joints");
            joints[2] = f64::NAN;
            let odd = servo.step(&seen, &joints, &[], 1.0).unwrap_err();
            assert_eq!(odd.to_string(), "joint reading 3 is NaN, not a finite number");
        }
    }
}

#[test]
fn limits_hold_on_the_way_and_it_arrives_nonetheless() {
    let dt = 0.02;
    for seed in 0..20 {
        let mut rig = if seed % 2 == 0 { random_rig(6, 2, 8, seed) } else { variants::on_hand(1, seed) };
        rig.robot.joints.iter_mut().for_each(|joint| joint.limits.velocity = Some(1.0));
        let arm = Arm::new(&rig).unwrap();
        let (start, target) = start_and_target(&rig, 0.5, seed);
        let goal = look(&arm, &rig, &target);
        let features = (0..rig.features.len()).collect::<Vec<_>>();
        let image = |camera| InImage { camera, features: features.clone(), margin: 0.0, strength: 10.0 };
        let images: Vec<InImage> = (0..rig.cameras.len()).map(image).collect();
        let limits: Vec<&dyn Limit> = images.iter().map(|image| image as &dyn Limit).collect();
        for mut servo in Servo::defaults(&rig) {
            servo.aim(&goal);
            let mut joints = start.clone();
            for _ in 0..150 {
                let step = servo.step(&look(&arm, &rig, &joints), &joints, &limits, dt).unwrap();
                assert!(!step.failed);
                moved(&mut joints, &step.motion);
                for ((joint, motion), limits) in joints.iter().zip(&step.motion).zip(arm.limits()) {
                    let range = limits.lower.unwrap() - 1e-9..=limits.upper.unwrap() + 1e-9;
                    assert!(range.contains(joint) && motion.abs() <= dt + 1e-9, "seed {seed}: {joint} by {motion}");
                }
                let inside =
                    |seen: &Sighting| (-1.5..640.5).contains(&seen.pixel[0]) && (-1.5..480.5).contains(&seen.pixel[1]);
                assert!(look(&arm, &rig, &joints).iter().all(inside), "seed {seed}: {}, out of view", servo.name());
            }
            let error = mean_error(&look(&arm, &rig, &joints), &goal);
            assert!(error < 0.1, "seed {seed}: {}, {error} px", servo.name());
        }
    }
}

#[test]
fn motions_are_finite_whatever_is_seen_or_aimed_at() {
    let mut finite = 0;
    for seed in 0..60 {
        let odd = if seed % 4 == 0 { [1e12, -1e150, 1e300, f64::INFINITY] } else { [0.0, -1e3, 1e5, f64::NAN] };
        let kind = KINDS[seed as usize % KINDS.len()].1;
        let mut rig = kind(seed);
        if seed % 3 == 0 {
            // All features in one place, and behind the camera.
            rig.features.iter_mut().for_each(|feature| feature.xyz = Some([0.0, 0.0, 0.0]));
            let turned = Pose::new(Vector3::new(0.0, std::f64::consts::PI, 0.0), Vector3::zeros());
            rig.cameras.iter_mut().for_each(|camera| camera.pose = camera.pose.map(|pose| pose * turned));
        }
        let arm = Arm::new(&rig).unwrap();
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let middle = |(lower, upper): (f64, f64)| 0.5 * (lower + upper);
        let home: Vec<f64> = arm
            .limits()
            .iter()
            .map(|limits| middle((limits.lower.unwrap_or(-1.0), limits.upper.unwrap_or(1.0))))
            .collect();
        let mut disturbed = |mut all: Vec<Sighting>| {
            for one in &mut all {
                if random.random_bool(0.3) {
                    one.pixel = [odd[random.random_range(0..odd.len())], odd[random.random_range(0..odd.len())]];
                }
            }
            all
        };
        for mut servo in Servo::defaults(&rig) {
            let mut joints = home.clone();
            if let Servo::Image(servo) = &mut servo {
                let depth = [0.0, -1.0, f64::NAN, 1e-300][seed as usize % 4];
                servo.settings.depths = vec![Depth { camera: 0, feature: 0, depth }];
            }
            for dt in [1.0, 0.0, f64::NAN, 0.01, 1.0] {
                servo.aim(&disturbed(look(&arm, &rig, &joints)));
                // Not enough data is an answer too.
                let Ok(step) = servo.step(&disturbed(look(&arm, &rig, &joints)), &joints, &[], dt) else { continue };
                assert!(step.motion.iter().all(|motion| motion.is_finite()), "seed {seed}: {:?}", step.motion);
                finite += 1;
                moved(&mut joints, &step.motion);
            }
            // And then it goes on.
            if let Servo::Image(servo) = &mut servo {
                servo.settings.depths.clear();
            }
            let seen = look(&arm, &rig, &home);
            servo.aim(&seen);
            let goes_on = servo.step(&seen, &home, &[], 1.0).is_ok_and(|step| !step.failed);
            assert!(goes_on || seed % 3 == 0, "seed {seed}: {}", servo.name());
        }
    }
    assert!(finite > 100, "{finite} of 600 steps gave a motion");
}

#[test]
fn given_depths_count_as_the_true_ones_do_and_need_not_be_exact() {
    for (index, &model) in CameraModel::ALL.iter().enumerate() {
        let mut rig = random_rig(6, 2, 12, index as u64);
        for camera in &mut rig.cameras {
            camera.model = Some(model);
            camera.distortion = Some(vec![0.01; model.distortion().len()]);
        }
        let arm = Arm::new(&rig).unwrap();
        let mut at = Configuration::default();
        arm.configure(&positions(&rig, 1, 1)[0], &mut at);
        for sighting in look(&arm, &rig, &at.joints) {
            let point = at.posture.tip().transform(&rig.features[sighting.feature].xyz.unwrap().into());
            let depth = at.cameras[sighting.camera].inverse_transform(&point).z;
            let (by_rig, by_depth) =
                (arm.sight(&at, &sighting).unwrap(), arm.sight_at_depth(&at, &sighting, depth).unwrap());
            for axis in 0..2 {
                for (a, b) in by_rig.slopes(axis).zip(by_depth.slopes(axis)) {
                    assert!((a - b).abs() < 1e-5 * (1.0 + a.abs()), "{}: {a} {b}", model.name());
                }
            }
        }
    }
    for seed in 0..20 {
        let rig = variants::on_hand(1, seed);
        let arm = Arm::new(&rig).unwrap();
        let (start, target) = start_and_target(&rig, 0.25, seed);
        let goal = look(&arm, &rig, &target);
        for share in [0.7, 1.4] {
            let settings = ImageSettings { gain: Gain::Constant(0.5), ..ImageSettings::default() };
            let mut servo = ImageBased::new(&rig, settings).unwrap();
            servo.aim(&goal);
            let (mut joints, mut at) = (start.clone(), Configuration::default());
            for _ in 0..40 {
                arm.configure(&joints, &mut at);
                let depth = |feature: &Feature| at.cameras[0].inverse_transform(&feature.xyz.unwrap().into()).z;
                let depths = rig.features.iter().enumerate();
                let depths = depths.map(|(i, feature)| Depth { camera: 0, feature: i, depth: share * depth(feature) });
                servo.settings.depths = depths.collect();
                let step = servo.step(&look(&arm, &rig, &joints), &joints, &[], 100.0).unwrap();
                moved(&mut joints, &step.motion);
            }
            let error = mean_error(&look(&arm, &rig, &joints), &goal);
            assert!(error < 0.01, "seed {seed}: {error} px with {share} of the depth");
        }
    }
}

#[test]
fn a_rig_that_is_off_costs_commands_and_not_accuracy() {
    for seed in 0..20 {
        let rig = if seed % 2 == 0 { random_rig(6, 2, 12, seed) } else { variants::on_hand(1, seed) };
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut off = rig.clone();
        for camera in &mut off.cameras {
            camera.fx = camera.fx.map(|fx| 1.02 * fx);
            let turn = Vector3::from_fn(|_, _| random.random_range(-0.02..0.02));
            camera.pose = camera.pose.map(|pose| pose * Pose::new(turn, turn * 0.3));
        }
        for joint in &mut off.robot.joints {
            joint.offset = joint.offset.map(|offset| offset + random.random_range(-0.01..0.01));
        }
        let (start, target) = start_and_target(&rig, 0.25, seed);
        let by_rig = look(&Arm::new(&off).unwrap(), &off, &target);
        let wrong = mean_error(&by_rig, &look(&Arm::new(&rig).unwrap(), &rig, &target));
        assert!(wrong > 3.0, "seed {seed}: the rig is off by {wrong} px only");
        // With the whole gain, one of these arms overshoots for ever by 0.3 px, along a direction that the pixels hardly tell.
        for mut servo in Servo::both(&off, InteractionMatrix::Mean, Gain::Constant(0.5)) {
            let error = servo.arrive(&rig, &start, &target, 80);
            assert!(error < 0.2, "seed {seed}: {}, {error} px", servo.name());
        }
    }
}
