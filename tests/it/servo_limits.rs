//! What limits promise while servoing: the tip and the links stay where they may be, and what holds a motion back is named.
use crate::servo::{moved, positions, without_range};
use handeye::rig::catalog;
use handeye::servo::limits::{Guide, HalfSpace, LinkDistance, TipBox, TipSpeed, VirtualFixture};
use handeye::servo::tasks::{JointTarget, TipPose};
use handeye::servo::{Arm, Bound, Configuration, Constraint, Goal, Limit, Stepper};
use handeye::simulate::random_rig;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Vector3};

/// The point nearest to one whose coordinates along three axes must lie between bounds.
fn nearest(
    point: &Vector3<f64>,
    origin: &Vector3<f64>,
    axes: &Matrix3<f64>,
    low: [f64; 3],
    high: [f64; 3],
) -> Vector3<f64> {
    let within = axes.transpose() * (point - origin);
    origin + axes * Vector3::from_fn(|k, _| within[k].clamp(low[k], high[k]))
}

#[test]
fn the_tip_stops_where_it_may_be_next_to_its_target_and_comes_back_from_outside() {
    let rig = catalog::rig("ur5").unwrap();
    let arm = Arm::new(&without_range(rig.clone())).unwrap();
    for (trial, start) in positions(&rig, 15, 7).into_iter().enumerate() {
        let mut at = Configuration::default();
        arm.configure(&start, &mut at);
        let tip = at.posture.tip();
        let turn = so3::exp(&Vector3::new(0.3 * trial as f64, 0.4, -0.2));
        // 4 cm outside at the start, and a target 10 cm outside on another side, 6 cm along.
        let origin = tip.translation - turn.column(0) * 0.06;
        let frame = Pose { rotation: turn, translation: origin };
        let target = origin + turn * Vector3::new(0.03, -0.1, 0.06);
        let (line, plane) = (Guide::Line(origin, turn.column(2) * 2.0), Guide::Plane(origin, turn.column(1) * 0.5));
        let strength = 10.0;
        let tip_box = TipBox {
            frame,
            low: Vector3::new(-0.02, -0.02, f64::NEG_INFINITY),
            high: Vector3::new(0.02, 0.02, 0.05),
            strength,
        };
        let (line, plane) = (
            VirtualFixture { guide: line, tolerance: 0.005, strength },
            VirtualFixture { guide: plane, tolerance: 0.005, strength },
        );
        let (wide, side) = (f64::INFINITY, 0.005 / 2.0_f64.sqrt());
        let cases: [(&dyn Limit, [f64; 3], [f64; 3]); 3] = [
            (&tip_box, [-0.02, -0.02, -wide], [0.02, 0.02, 0.05]),
            (&line, [-side, -side, -wide], [side, side, wide]),
            (&plane, [-wide, -0.005, -wide], [wide, 0.005, wide]),
        ];
        for (index, (limit, low, high)) in cases.into_iter().enumerate() {
            // A line's tolerance is along axes of its own.
            let loose = if index == 1 { 0.006 } else { 2e-4 };
            let task = TipPose { target: Pose { translation: target, ..tip }, xyz_sd: 0.001, rot_sd: f64::INFINITY };
            let (mut joints, mut stepper) = (start.clone(), Stepper::default());
            for _ in 0..300 {
                arm.configure(&joints, &mut at);
                let step = stepper.step(&arm, &at, &[Goal { share: 0.1, ..Goal::new(&task) }], &[limit], 0.01);
                assert!(!step.failed);
                moved(&mut joints, &step.motion);
            }
            arm.configure(&joints, &mut at);
            let off = (at.posture.tip().translation - nearest(&target, &origin, &turn, low, high)).norm();
            assert!(off < loose, "trial {trial}, limit {index}: {off} m from the nearest point");
        }
    }
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
    let target = JointTarget::new(joints.iter().map(|joint| joint + 0.01).collect(), 0.1);
    let mut stepper = Stepper::default();
    let step = stepper.step(&arm, &at, &[Goal::new(&target)], &[], 0.01);
    let held: Vec<Constraint> = step.active.iter().map(|active| active.constraint).collect();
    assert_eq!(held, [Constraint::Joint { joint: 2, bound: Bound::Velocity, upper: true }]);
    assert!((step.motion[2] - 0.001).abs() < 1e-9);
    at.joints[3] = f64::NAN;
    let step = stepper.step(&arm, &at, &[Goal::new(&target)], &[], 0.01);
    assert!(step.failed && step.motion.iter().all(|motion| *motion == 0.0));
}

#[test]
fn limits_that_cannot_all_hold_are_named_with_the_joints_that_are_in_their_way() {
    let rig = catalog::rig("ur5").unwrap();
    for joints in positions(&rig, 20, 10) {
        let mut slow = rig.clone();
        slow.robot.joints.iter_mut().for_each(|joint| joint.limits.velocity = Some(0.1));
        let arm = Arm::new(&slow).unwrap();
        let mut at = Configuration::default();
        arm.configure(&joints, &mut at);
        let up = at.posture.tip().translation.z;
        // Two limits that face each other: each can hold, both cannot; and one that is out of the joints' reach.
        let below = HalfSpace { normal: Vector3::z(), offset: up - 1e-4, strength: 1.0 };
        let above = HalfSpace { normal: -Vector3::z(), offset: -up - 1e-4, strength: 2.0 };
        let idle = TipSpeed { speed: 1000.0, strength: 1.0 };
        let hold = JointTarget::new(joints.clone(), 0.1);
        let mut stepper = Stepper::default();
        let step = stepper.step(&arm, &at, &[Goal::new(&hold)], &[&idle, &below, &above], 0.01);
        let named = |limit| Constraint::Limit { limit, row: 0 };
        assert_eq!(step.conflict, [named(1), named(2)]);
        let slack: Vec<_> = step.active.iter().filter(|active| active.slack > 0.0).map(|a| a.constraint).collect();
        assert_eq!(slack, [named(1)], "the weaker one gives way");
        let far = HalfSpace { offset: up - 1.0, ..below };
        let step = stepper.step(&arm, &at, &[Goal::new(&hold)], &[&idle, &far], 0.01);
        assert!(step.conflict.contains(&named(1)), "{:?}", step.conflict);
        let of_joints =
            |constraint: &&Constraint| matches!(constraint, Constraint::Joint { bound: Bound::Velocity, .. });
        assert_eq!(step.conflict.iter().filter(of_joints).count() + 1, step.conflict.len(), "{:?}", step.conflict);
        let free = stepper.step(&arm, &at, &[Goal::new(&hold)], &[&idle], 0.01);
        assert!(free.conflict.is_empty() && free.active.is_empty());
    }
}
