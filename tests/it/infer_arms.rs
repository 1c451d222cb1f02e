//! Every shipped arm is inferred, and nothing that is thrown at inference makes it panic.
use crate::infer::inference;
use crate::infer_rigs::whole;
use handeye::infer::{InferOptions, Inference, InverseKinematics, InverseOptions, Prior, Sighting};
use handeye::rig::{Model, Rig, catalog};
use handeye::solvers::Pose;
use nalgebra::{DMatrix, Vector3};

/// Arms of the catalogue are without cameras: two look at the tip from 1.2 m, wherever it is.
fn watched(name: &str, seed: u64) -> (Rig, Inference, Vec<Sighting>, Vec<f64>) {
    let mut rig = catalog::rig(name).unwrap();
    let share = |i: usize| 0.5 + 0.4 * ((seed as usize * 37 + i * 101) as f64 * 0.917).sin();
    let reading = |(i, joint): (usize, &handeye::rig::Joint)| {
        let (lower, upper) = (joint.limits.lower.unwrap_or(-3.0), joint.limits.upper.unwrap_or(3.0));
        lower + share(i) * (upper - lower)
    };
    let truth: Vec<f64> = rig.robot.joints.iter().enumerate().map(reading).collect();
    let ur5 = catalog::rig("ur5").unwrap();
    let arm = Rig { robot: rig.robot.clone(), ..Rig::default() };
    let tip = Model::new(&arm).unwrap().tip(&truth).translation;
    rig.features = ur5.features.clone();
    rig.cameras = ur5.cameras.clone();
    for camera in &mut rig.cameras {
        let pose = camera.pose.as_mut().unwrap();
        pose.translation = tip - pose.rotation.column(2) * 1.2;
    }
    let model = Model::new(&rig).unwrap();
    let links = model.links(&truth);
    let sighting = |k: usize| {
        let (camera, feature) = (k / 12, k % 12);
        Sighting { camera, feature, pixel: model.pixel(camera, feature, &links) }
    };
    let seen = (0..24).map(sighting).collect();
    let inference = inference(&rig);
    (rig, inference, seen, truth)
}

#[test]
fn every_shipped_arm_is_inferred_to_the_pixel() {
    for (name, _) in catalog::ALL {
        for seed in 1..=10 {
            let (rig, mut inference, seen, truth) = watched(name, seed);
            let found = inference.joints(&seen, &Prior::none()).unwrap();
            assert!(found[0].rms_px < 1e-4, "{name} {seed}: {} px", found[0].rms_px);
            let tip = Model::new(&rig).unwrap().tip(&truth);
            let off = (found[0].pose.translation - tip.translation).norm();
            assert!(off < 1e-5 && found[0].pose.angle_to(&tip) < 1e-4, "{name} {seed}: {off} m");
            let redundant = rig.robot.joints.len().saturating_sub(6);
            assert!(found[0].open.len() >= redundant, "{name} {seed}");
            let eigen = found[0].covariance.clone().symmetric_eigenvalues();
            assert!(eigen.min() > 0.0 && found[0].covariance == found[0].covariance.transpose());
            let from_truth = inference.joints_near(&seen, &Prior::start(&truth)).unwrap();
            let moved = DMatrix::from_row_slice(1, truth.len(), &from_truth.joints)
                - DMatrix::from_row_slice(1, truth.len(), &truth);
            assert!(moved.amax() < 1e-6, "{name} {seed}: moved away from the truth by {}", moved.amax());
        }
    }
}

#[test]
fn garbage_is_refused_or_left_out_and_nothing_panics() {
    let mut rig = catalog::rig("ur5").unwrap();
    let (seen, truth) = whole(&rig, 1, 3).remove(0);
    let mut plain = inference(&rig);
    let expected = plain.joints(&seen, &Prior::none()).unwrap();
    let mut dirty = seen.clone();
    for garbage in [(99, 0, 1.0), (0, 99, 1.0), (0, 0, f64::NAN), (1, 3, f64::INFINITY)] {
        dirty.push(Sighting { camera: garbage.0, feature: garbage.1, pixel: [garbage.2, 5.0] });
    }
    assert_eq!(plain.joints(&dirty, &Prior::none()).unwrap(), expected);
    assert!(plain.joints(&seen, &Prior::start(&[f64::NAN; 6])).is_err());
    assert!(plain.joints(&seen, &Prior::readings(&truth, 0.0)).is_err());
    assert!(plain.joints_near(&seen, &Prior::none()).is_err());
    assert!(plain.joints_after(&expected, &[0.0; 5], &seen).is_err());
    assert!(plain.joints_after(&expected, &[f64::NAN; 6], &seen).is_err());
    assert!(plain.joints_of_history(&[], &Prior::none()).is_err());
    assert!(Inference::new(&Rig::default(), InferOptions::default()).is_err());
    rig.robot.joints[0].limits.lower = Some(f64::NAN);
    (rig.robot.joints[1].limits.lower, rig.robot.joints[1].limits.upper) = (Some(1.0), Some(-1.0));
    let mut inverse = InverseKinematics::new(&rig, InverseOptions::default()).unwrap();
    let nowhere = Pose::new(Vector3::zeros(), Vector3::repeat(f64::NAN));
    assert!(!inverse.solve(&nowhere, &[f64::NAN; 3]).reached);
    assert!(inverse.branches(&nowhere, &[]).is_empty());
    let _ = inference(&rig).joints(&seen, &Prior::none());
}
