//! Singularities slow a servo loop down and do not stop it.
use crate::servo::{moved, positions, without_range};
use handeye::rig::catalog;
use handeye::servo::tasks::TipPose;
use handeye::servo::{Arm, Configuration, Goal, Stepper};
use handeye_solvers::Pose;
use nalgebra::DMatrix;

/// det J of the tip, which changes its sign at singularities.
fn determinant(arm: &Arm, joints: &[f64]) -> f64 {
    let (mut at, mut columns) = (Configuration::default(), vec![[0.0; 6]; 6]);
    arm.configure(joints, &mut at);
    at.posture.jacobian(&mut columns);
    DMatrix::from_fn(6, 6, |row, column| columns[column][row]).determinant()
}

#[test]
fn a_path_through_singularities_is_followed_to_its_end_below_the_limits_of_the_joints() {
    let start = catalog::rig("ur5").unwrap();
    let mut rig = without_range(start.clone());
    rig.robot.joints.iter_mut().for_each(|joint| joint.limits.velocity = Some(1.0));
    let arm = Arm::new(&rig).unwrap();
    // Wrist and elbow stretched, and the wrist above the first axis: where the determinant vanishes for another reason.
    for (trial, place) in positions(&start, 30, 12).into_iter().enumerate() {
        let (mut singular, through) = (place, [4, 2, 1][trial % 3]);
        if through == 1 {
            let sign = |angle: f64| {
                let at: Vec<f64> = singular.iter().enumerate().map(|(i, q)| if i == 1 { angle } else { *q }).collect();
                determinant(&arm, &at)
            };
            let angles = (0..64).map(|step| -std::f64::consts::PI + 0.1 * f64::from(step));
            let mut low = angles.into_iter().find(|angle| sign(*angle) * sign(angle + 0.1) <= 0.0).unwrap();
            let mut high = low + 0.1;
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if sign(low) * sign(middle) <= 0.0 { high = middle } else { low = middle }
            }
            singular[1] = low;
        } else {
            singular[through] = 0.0;
        }
        assert!(determinant(&arm, &singular).abs() < 1e-9, "trial {trial}");
        let on_path = |share: f64| -> Vec<f64> {
            let mut joints = singular.clone();
            joints.iter_mut().for_each(|joint| *joint += 0.2 * (share - 0.5));
            joints[through] += 0.6 * (share - 0.5);
            joints
        };
        let (mut joints, mut at, mut stepper) = (on_path(0.0), Configuration::default(), Stepper::default());
        let mut task = TipPose { target: Pose::identity(), xyz_sd: 0.001, rot_sd: 0.003 };
        for index in 0..900 {
            arm.configure(&on_path((f64::from(index) / 300.0).min(1.0)), &mut at);
            task.target = at.posture.tip();
            arm.configure(&joints, &mut at);
            let step = stepper.step(&arm, &at, &[Goal::new(&task)], &[], 0.01);
            assert!(!step.failed && step.motion.iter().all(|motion| motion.abs() <= 0.01), "trial {trial}: {step:?}");
            moved(&mut joints, &step.motion);
        }
        arm.configure(&joints, &mut at);
        let left =
            (at.posture.tip().translation - task.target.translation).norm() + at.posture.tip().angle_to(&task.target);
        assert!(left < 1e-6, "trial {trial}, through joint {through}: {left:.1e}");
    }
}
