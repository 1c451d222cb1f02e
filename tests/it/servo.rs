//! What servoing with a rig promises: steps that arrive, and that keep their limits whatever comes in.
use handeye::infer::Sighting;
use handeye::rig::{Limits, Rig, catalog};
use handeye::servo::tasks::{ImagePoints, JointTarget, LookAt, Manipulability, TipMotion, TipPose};
use handeye::servo::{Arm, Configuration, Goal, ModelBased, Stepper};
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

/// A rig whose joints turn on and on.
pub fn without_range(mut rig: Rig) -> Rig {
    rig.robot.joints.iter_mut().for_each(|joint| (joint.limits.lower, joint.limits.upper) = (None, None));
    rig
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
    let tasks: [&dyn handeye::servo::Task; 6] = [
        &Manipulability { of: TipMotion::Pose, length: 0.3, wanted: 100.0, sd: 0.1 },
        &Manipulability { of: TipMotion::Position, length: 0.3, wanted: 100.0, sd: 0.1 },
        &ImagePoints { targets: goal, seen: Vec::new(), sd: 2.0 },
        &JointTarget::new(joints[1].clone(), 0.1),
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
        let posture = JointTarget {
            joints: goal.iter().map(|joint| joint + 0.2).collect(),
            sd: (0..7).map(|_| random.random_range(0.1..0.2)).collect(),
        };
        let goals = [Goal::new(&pose), Goal { priority: 1, ..Goal::new(&posture) }];
        let mut stepper = Stepper::default();
        for _ in 0..400 {
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
        let away = DVector::from_fn(arm.joints(), |i, _| (posture.joints[i] - joints[i]) / posture.sd[i].powi(2));
        let within =
            DMatrix::identity(arm.joints(), arm.joints()) - jacobian.clone().pseudo_inverse(1e-9).unwrap() * &jacobian;
        let held = at.joints.iter().zip(arm.limits()).any(|(joint, limits)| {
            limits.lower.is_some_and(|lower| joint - lower < 1e-6)
                || limits.upper.is_some_and(|upper| upper - joint < 1e-6)
        });
        let slope = (&within * &away).norm() / away.norm();
        assert!(held || slope < 1e-5, "trial {trial}: the posture could be nearer by {slope:.1e} of the slope");
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
fn what_tasks_leave_open_is_spent_on_moving_away_from_singularities() {
    let rig = without_range(catalog::rig("ur5").unwrap());
    let arm = Arm::new(&rig).unwrap();
    // Yoshikawa's measure as the product of singular values.
    let measure = |joints: &[f64]| {
        let (mut at, mut columns) = (Configuration::default(), vec![[0.0; 6]; 6]);
        arm.configure(joints, &mut at);
        at.posture.jacobian(&mut columns);
        let scaled = |row: usize, column: usize| columns[column][row] / if row < 3 { 1.0 } else { 0.3 };
        DMatrix::from_fn(6, 6, scaled).singular_values().product()
    };
    for (trial, mut joints) in positions(&catalog::rig("ur5").unwrap(), 20, 8).into_iter().enumerate() {
        // A wrist that is nearly stretched, of an arm of which only the tip's position is wanted.
        joints[4] = if trial % 2 == 0 { 0.01 } else { -0.01 };
        let mut at = Configuration::default();
        arm.configure(&joints, &mut at);
        let place = TipPose { target: at.posture.tip(), xyz_sd: 0.001, rot_sd: f64::INFINITY };
        let away = Manipulability { of: TipMotion::Pose, length: 0.3, wanted: 10.0, sd: 0.1 };
        let before = measure(&joints);
        assert!((away.measure(&at) / before - 1.0).abs() < 0.01, "trial {trial}: {} {before}", away.measure(&at));
        let goals = [Goal::new(&place), Goal { priority: 1, share: 0.1, ..Goal::new(&away) }];
        let mut stepper = Stepper::default();
        for _ in 0..300 {
            arm.configure(&joints, &mut at);
            let step = stepper.step(&arm, &at, &goals, &[], 0.01);
            assert!(!step.failed && step.motion.iter().all(|motion| motion.is_finite()), "trial {trial}");
            moved(&mut joints, &step.motion);
        }
        arm.configure(&joints, &mut at);
        let (after, off) = (measure(&joints), (at.posture.tip().translation - place.target.translation).norm());
        assert!(after > 10.0 * before && off < 1e-4, "trial {trial}: {before} to {after}, {off} m off");
    }
}
