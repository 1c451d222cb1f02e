//! Every residual and derived node of the model has the derivatives that differences of it show, whatever is held.
use handeye::camera::CameraModel;
use handeye::chain::{Chain, Convention, JointKind};
use handeye::factors::{
    CameraFromTarget, Drifting, ForwardKinematics, InCamera, Intrinsics, JointAction, JointReading, Motion,
    PointObservation, PoseAction, PoseReading, Reprojection, TargetSeen,
};
use handeye::solvers::{DynamicVector, Function, Pose, Vector, check};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

const SEEDS: u64 = 20;

/// Where factors are looked at.
struct Place(ChaCha8Rng);

impl Place {
    fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.0.random_range(-size..size))
    }

    fn pose(&mut self) -> Pose {
        Pose::new(self.vector(1.5), self.vector(1.0))
    }

    fn numbers(&mut self, n: usize) -> DynamicVector {
        DynamicVector::from_fn(n, |_, _| self.0.random_range(-1.0..1.0))
    }

    /// Carrier, feature, mount and camera, with the feature at a point in the camera's frame.
    fn view(&mut self, in_camera: Vector3<f64>) -> (Pose, Vector<3>, Pose, Pose) {
        let (carrier, mount, camera) = (self.pose(), self.pose(), self.pose());
        let feature = carrier.inverse_transform(&(mount * camera).transform(&in_camera));
        (carrier, feature, mount, camera)
    }
}

fn places() -> impl Iterator<Item = Place> {
    (0..SEEDS).map(|seed| Place(ChaCha8Rng::seed_from_u64(seed)))
}

#[test]
fn what_cameras_see_has_the_derivatives_of_differences() {
    for mut place in places() {
        let in_camera = Vector3::new(0.0, 0.0, 1.4) + place.vector(0.4);
        let (carrier, feature, mount, camera) = place.view(in_camera);
        for &model in CameraModel::ALL {
            let mut intrinsics = Intrinsics::zeros();
            intrinsics.fixed_rows_mut::<4>(0).copy_from_slice(&[600.0, 610.0, 320.0, 240.0]);
            intrinsics
                .rows_mut(4, model.distortion().len())
                .copy_from(&(place.numbers(model.distortion().len()) * 0.02));
            let factor = Reprojection { pixel: [300.0, 200.0], model };
            check::factor(&factor, &(carrier, feature, mount, camera, intrinsics)).unwrap();
        }
        let factor = PointObservation { point: (in_camera + place.vector(0.1)).into() };
        check::factor(&factor, &(carrier, feature, mount, camera)).unwrap();
        check::function(&InCamera, &(carrier, feature, mount, camera)).unwrap();
        let target = Pose::new(place.vector(0.2), place.vector(0.1));
        let predicted = CameraFromTarget.compute((carrier, target, mount, camera));
        check::function(&CameraFromTarget, &(carrier, target, mount, camera)).unwrap();
        let seen = predicted * Pose::new(place.vector(0.2), place.vector(0.1));
        let (scale, drift) = (Vector::<1>::new(1.2), Vector::<6>::from_fn(|_, _| 0.1));
        for camera_stands in [false, true] {
            check::factor(&TargetSeen { seen, camera_stands }, &(predicted, scale, drift)).unwrap();
        }
        check::factor(&Drifting, &(drift, 2.0 * drift)).unwrap();
    }
}

#[test]
fn what_robots_read_and_do_has_the_derivatives_of_differences() {
    for mut place in places() {
        let (before, after) = (place.pose(), place.pose());
        check::factor(&PoseReading { reading: place.pose() * before }, &(before, place.pose())).unwrap();
        check::factor(&PoseAction { action: place.pose() }, &(before, after)).unwrap();
        check::function(&Motion, &(before, after)).unwrap();
        let (joints, next) = (place.numbers(4), place.numbers(4));
        check::factor(&JointReading { joint: 2, reading: 0.3 }, &(joints.clone(),)).unwrap();
        check::factor(&JointAction { joint: 1, action: 0.2 }, &(joints.clone(), next)).unwrap();
        for convention in [Convention::Dh, Convention::ModifiedDh] {
            let kinds = vec![JointKind::Revolute, JointKind::Prismatic, JointKind::Revolute, JointKind::Revolute];
            let chain = Arc::new(Chain { convention, kinds, reversed: vec![false, true, true, false], frames: None });
            for upto in 0..=4 {
                let function = ForwardKinematics { chain: chain.clone(), upto };
                check::function(&function, &(place.pose(), place.numbers(20), joints.clone())).unwrap();
            }
        }
    }
}

/// A point where the model has it leaves nothing; one that is off leaves how far, along the camera's axes.
#[test]
fn a_point_is_compared_in_the_frame_of_the_camera() {
    use handeye::solvers::Factor;
    for mut place in places() {
        let (in_camera, off) = (place.vector(1.0), place.vector(0.1));
        let factor = PointObservation { point: (in_camera - off).into() };
        let residual = factor.residual::<f64>(place.view(in_camera));
        assert!((Vector3::from(residual) - off).norm() < 1e-12, "{residual:?}");
    }
}
