//! What servoing with a rig promises: steps that arrive, and that keep their limits whatever comes in.
use handeye::chain::JointKind;
use handeye::infer::Sighting;
use handeye::rig::{Limits, Rig, catalog};
use handeye::servo::limits::{HalfSpace, InImage, LinkDistance, PixelSpeed, TipSpeed};
use handeye::servo::tasks::{ImagePoints, JointTarget, LookAt, TipPose};
use handeye::servo::{Arm, Bound, Configuration, Constraint, Goal, Limit, ModelBased, Stepper};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Joint positions of a rig that have its features in view.
pub fn positions(rig: &Rig, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let options = SimulateOptions { samples: count, seed, in_view: 1.0, ..SimulateOptions::default() };
    let truth = simulate(rig, &options).unwrap().truth;
    truth.samples.into_iter().map(|sample| sample.joints.unwrap()).collect()
}

/// What all cameras see of all features, in view or not.
pub fn look(arm: &Arm, rig: &Rig, joints: &[f64]) -> Vec<Sighting> {
    let mut at = Configuration::default();
    arm.configure(joints, &mut at);
    let pairs = (0..rig.cameras.len()).flat_map(|camera| (0..rig.features.len()).map(move |feature| (camera, feature)));
    pairs
        .map(|(camera, feature)| Sighting { camera, feature, pixel: arm.pixel(&at, camera, feature).unwrap() })
        .collect()
}

pub fn mean_error(seen: &[Sighting], goal: &[Sighting]) -> f64 {
    let distance = |(a, b): (&Sighting, &Sighting)| (a.pixel[0] - b.pixel[0]).hypot(a.pixel[1] - b.pixel[1]);
    seen.iter().zip(goal).map(distance).sum::<f64>() / seen.len() as f64
}

pub fn moved(joints: &mut [f64], motion: &[f64]) {
    joints.iter_mut().zip(motion).for_each(|(joint, step)| *joint += step);
}

#[test]
fn the_rows_of_every_task_are_its_derivatives() {
    let rig = random_rig(6, 2, 4, 3);
    let arm = Arm::new(&rig).unwrap();
    let joints = positions(&rig, 2, 3);
    let goal = look(&arm, &rig, &joints[1]);
    let mut other = Configuration::default();
    arm.configure(&joints[1], &mut other);
    let target = other.posture.tip();
    let tasks: [&dyn handeye::servo::Task; 4] = [
        &ImagePoints { targets: goal, seen: Vec::new(), sd: 2.0 },
        &JointTarget { joints: joints[1].clone(), sd: 0.1 },
        &TipPose { target, xyz_sd: 0.01, rot_sd: f64::INFINITY },
        &LookAt { point: Vector3::new(0.3, -0.4, 0.2), axis: Vector3::z(), sd: 0.1 },
    ];
    for (index, task) in tasks.iter().enumerate() {
        let rows = |joints: &[f64]| {
            let (mut at, mut rows) = (Configuration::default(), handeye::servo::TaskRows::default());
            arm.configure(joints, &mut at);
            rows.clear(6);
            task.rows(&arm, &at, &mut rows);
            rows
        };
        let here = rows(&joints[0]);
        for k in 0..6 {
            let step = 1e-6;
            let (mut high, mut low) = (joints[0].clone(), joints[0].clone());
            high[k] += step;
            low[k] -= step;
            let (high, low) = (rows(&high), rows(&low));
            for i in 0..here.len() {
                // What is wanted shrinks as the joints do their part.
                let difference = (low.row(i).1 - high.row(i).1) / (2.0 * step);
                let slope = here.row(i).0[k];
                assert!((difference - slope).abs() < 1e-4 * (1.0 + slope.abs()), "task {index}: {difference} {slope}");
            }
        }
    }
}

#[test]
fn tasks_arrive_from_nearby_and_lower_priorities_move_only_what_is_left() {
    let rig = catalog::rig("wam7").unwrap();
    let arm = Arm::new(&rig).unwrap();
    let random = &mut ChaCha8Rng::seed_from_u64(4);
    let mut free = 0;
    for trial in 0..50 {
        let middle = |limits: &Limits| 0.5 * (limits.lower.unwrap_or(-1.0) + limits.upper.unwrap_or(1.0));
        let mut draw = |spread: f64| -> Vec<f64> {
            arm.limits().iter().map(|limits| middle(limits) + spread * random.random_range(-0.5..0.5)).collect()
        };
        let (goal, away) = (draw(1.0), draw(0.5));
        let mut joints: Vec<f64> = goal
            .iter()
            .zip(away)
            .zip(arm.limits())
            .map(|((joint, away), limits)| joint + away - middle(limits))
            .collect();
        let mut at = Configuration::default();
        arm.configure(&goal, &mut at);
        let pose = TipPose { target: at.posture.tip(), xyz_sd: 0.001, rot_sd: 0.001 };
        let posture = JointTarget { joints: goal.iter().map(|joint| joint + 0.2).collect(), sd: 0.1 };
        let goals = [Goal::new(&pose), Goal { priority: 1, ..Goal::new(&posture) }];
        let mut stepper = Stepper::default();
        for _ in 0..200 {
            arm.configure(&joints, &mut at);
            let step = stepper.step(&arm, &at, &goals, &[], 1.0);
            assert!(!step.failed, "trial {trial}");
            moved(&mut joints, &step.motion);
        }
        arm.configure(&joints, &mut at);
        let tip = at.posture.tip();
        let left = (tip.translation - pose.target.translation).norm() + tip.angle_to(&pose.target);
        assert!(left < 1e-6, "trial {trial}: {left:.1e}");
        // The posture is as near as the pose allows: along the arm's null space, its error has no slope. The null space is found by
        // itself, from the tip's geometric Jacobian.
        let mut columns = vec![[0.0; 6]; arm.joints()];
        at.posture.jacobian(&mut columns);
        let jacobian = DMatrix::from_fn(6, arm.joints(), |row, column| columns[column][row]);
        let away = DVector::from_fn(arm.joints(), |i, _| posture.joints[i] - joints[i]);
        let within =
            DMatrix::identity(arm.joints(), arm.joints()) - jacobian.clone().pseudo_inverse(1e-9).unwrap() * &jacobian;
        let held = at.joints.iter().zip(arm.limits()).any(|(joint, limits)| {
            limits.lower.is_some_and(|lower| joint - lower < 1e-6)
                || limits.upper.is_some_and(|upper| upper - joint < 1e-6)
        });
        let slope = (&within * &away).norm();
        assert!(held || slope < 1e-5, "trial {trial}: the posture could be nearer by a slope of {slope:.1e}");
        free += usize::from(!held);
    }
    assert!(free >= 40, "limits held the arm in all but {free} of 50 trials");
}

#[test]
fn looking_at_a_point_turns_the_axis_onto_it() {
    let rig = catalog::rig("ur5").unwrap();
    let arm = Arm::new(&rig).unwrap();
    for (trial, joints) in positions(&rig, 20, 5).into_iter().enumerate() {
        let (mut joints, mut at, mut stepper) = (joints, Configuration::default(), Stepper::default());
        // Half a radian off the axis, half a metre away.
        arm.configure(&joints, &mut at);
        let point = at.posture.tip().transform(&Vector3::new(0.2, 0.15, 0.44));
        let task = LookAt { point, axis: Vector3::z(), sd: 0.01 };
        for _ in 0..300 {
            arm.configure(&joints, &mut at);
            let step = stepper.step(&arm, &at, &[Goal::new(&task)], &[], 0.05);
            moved(&mut joints, &step.motion);
        }
        arm.configure(&joints, &mut at);
        let tip = at.posture.tip();
        let sine = (tip.rotation * task.axis).cross(&(task.point - tip.translation).normalize());
        assert!(sine.norm() < 1e-6, "trial {trial}: {:.1e}", sine.norm());
    }
}

#[test]
fn a_true_rig_reaches_its_target_with_one_command() {
    for seed in 0..100 {
        let rig = random_rig(6, 2, 12, seed);
        let arm = Arm::new(&rig).unwrap();
        let places = positions(&rig, 2, seed);
        let goal = look(&arm, &rig, &places[1]);
        let mut servo = ModelBased::new(&rig).unwrap();
        servo.aim(&goal);
        let mut joints = places[0].clone();
        let motion = servo.step(&look(&arm, &rig, &joints), &joints, &[], 100.0).unwrap().motion.clone();
        moved(&mut joints, &motion);
        let error = mean_error(&look(&arm, &rig, &joints), &goal);
        assert!(error < 0.01, "seed {seed}: {error} px");
    }
}

#[test]
fn limits_hold_in_every_step_and_nothing_is_ever_returned_that_is_not_finite() {
    let dt = 0.02;
    let (mut in_view, mut kept_steps) = (0, 0);
    let mut loops = 0;
    for seed in 0..1000 {
        let kind = seed as usize % 4;
        let mut rig = random_rig([4, 6, 7, 5][kind], 2, 6, seed);
        if kind == 3 {
            let slider = &mut rig.robot.joints[2];
            slider.kind = JointKind::Prismatic;
            (slider.limits.lower, slider.limits.upper) = (Some(-0.1), Some(0.1));
        }
        for joint in &mut rig.robot.joints {
            joint.limits.velocity = Some(1.5);
            joint.limits.acceleration = Some(20.0);
        }
        let arm = Arm::new(&rig).unwrap();
        let places = positions(&rig, 2, seed);
        let goal = look(&arm, &rig, &places[1]);
        let starts_outside = seed % 5 == 0;
        let mut joints = places[0].clone();
        if starts_outside {
            joints[1] = rig.robot.joints[1].limits.upper.unwrap() + 0.3;
        }
        let task = ImagePoints { targets: goal, seen: Vec::new(), sd: 1.0 };
        let features: Vec<usize> = (0..rig.features.len()).collect();
        let image = |camera| InImage { camera, features: features.clone(), margin: 5.0, strength: 10.0 };
        let (left, right) = (image(0), image(1));
        let speed = PixelSpeed { camera: 0, features: features.clone(), speed: 400.0, strength: 1.0 };
        let floor = HalfSpace { normal: -Vector3::z(), offset: 2.0, strength: 50.0 };
        let tip_speed = TipSpeed { speed: 0.5, strength: 5.0 };
        let limits: [&dyn Limit; 5] = [&left, &right, &speed, &floor, &tip_speed];
        let (mut at, mut stepper) = (Configuration::default(), Stepper::default());
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut stayed = true;
        for index in 0..60 {
            arm.configure(&joints, &mut at);
            let step = stepper.step(&arm, &at, &[Goal::new(&task)], &limits, dt).clone();
            assert!(!step.failed, "seed {seed}, step {index}");
            for (i, (motion, limits)) in step.motion.iter().zip(arm.limits()).enumerate() {
                let (before, after) = (joints[i], joints[i] + motion);
                let (lower, upper) = (limits.lower.unwrap(), limits.upper.unwrap());
                let (least, most) = (lower.min(before), upper.max(before));
                assert!(
                    motion.is_finite() && (least - 1e-12..=most + 1e-12).contains(&after),
                    "seed {seed}: joint {i}"
                );
                assert!(motion.abs() <= 1.5 * dt + 1e-12, "seed {seed}: joint {i} too fast");
            }
            // Where no slack was needed, the tip keeps its speed.
            let mut columns = vec![[0.0; 6]; arm.joints()];
            at.posture.jacobian(&mut columns);
            let along =
                |k: usize| columns.iter().zip(&step.motion).map(|(column, motion)| column[3 + k] * motion).sum::<f64>();
            let speed = along(0).hypot(along(1)).hypot(along(2)) / dt;
            let kept = !step.active.iter().any(|active| active.slack > 0.0);
            kept_steps += usize::from(kept);
            assert!(!kept || speed < 0.5 * (1.0 + 1e-6), "seed {seed}: tip at {speed} m/s");
            for (joint, motion) in joints.iter_mut().zip(&step.motion) {
                *joint += motion * random.random_range(0.9..1.0);
            }
            at.velocity = step.motion.iter().map(|motion| motion / dt).collect();
            stayed &= look(&arm, &rig, &joints).iter().all(|seen| {
                let [u, v] = seen.pixel;
                (-0.5..=639.5).contains(&u) && (-0.5..=479.5).contains(&v)
            });
        }
        if !starts_outside {
            loops += 1;
            in_view += usize::from(stayed);
        }
    }
    assert!(kept_steps > 1000 * 60 / 2, "limits gave way in all but {kept_steps} steps");
    assert!(100 * in_view >= 99 * loops, "features stayed in the images of {in_view} of {loops} loops");
}

#[test]
fn links_keep_their_distance_on_the_way_to_where_they_would_meet() {
    let rig = catalog::rig("ur5").unwrap();
    let arm = Arm::new(&rig).unwrap();
    let mut pressed = 0;
    for (trial, mut joints) in positions(&rig, 20, 6).into_iter().enumerate() {
        let mut at = Configuration::default();
        arm.configure(&joints, &mut at);
        // To the middle of the upper arm, which the tip must not come nearer to than 15 cm.
        let middle = Vector3::new(0.2, 0.0, 0.0);
        let apart = LinkDistance { links: [6, 2], points: [Vector3::zeros(), middle], distance: 0.15, strength: 10.0 };
        let mut stepper = Stepper::default();
        for index in 0..400 {
            arm.configure(&joints, &mut at);
            let mut target = at.posture.tip();
            target.translation = at.posture.links[2].transform(&middle);
            let task = TipPose { target, xyz_sd: 0.01, rot_sd: f64::INFINITY };
            let goals = [Goal { share: 0.05, ..Goal::new(&task) }];
            let step = stepper.step(&arm, &at, &goals, &[&apart], 0.01);
            pressed += usize::from(index == 399 && !step.active.is_empty());
            moved(&mut joints, &step.motion);
            arm.configure(&joints, &mut at);
            let between = at.posture.tip().translation - at.posture.links[2].transform(&middle);
            assert!(between.norm() > 0.15 - 1e-3, "trial {trial}: {} m in step {index}", between.norm());
        }
    }
    assert!(pressed > 10, "the tip came up against the arm in {pressed} of 20 loops only");
}

#[test]
fn what_holds_a_motion_back_is_named() {
    let mut rig = random_rig(6, 2, 4, 9);
    rig.robot.joints[2].limits.velocity = Some(0.1);
    let arm = Arm::new(&rig).unwrap();
    let joints = positions(&rig, 1, 9).remove(0);
    let mut at = Configuration::default();
    arm.configure(&joints, &mut at);
    let target = JointTarget { joints: joints.iter().map(|joint| joint + 0.01).collect(), sd: 0.1 };
    let mut stepper = Stepper::default();
    let step = stepper.step(&arm, &at, &[Goal::new(&target)], &[], 0.01);
    let held: Vec<Constraint> = step.active.iter().map(|active| active.constraint).collect();
    assert_eq!(held, [Constraint::Joint { joint: 2, bound: Bound::Velocity, upper: true }]);
    assert!((step.motion[2] - 0.001).abs() < 1e-9);
    at.joints[3] = f64::NAN;
    let step = stepper.step(&arm, &at, &[Goal::new(&target)], &[], 0.01);
    assert!(step.failed && step.motion.iter().all(|motion| *motion == 0.0));
}
