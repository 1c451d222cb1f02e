//! A feature as a depth camera sees it: a point in the camera's frame.
use super::reprojection::write;
use handeye_solvers::{Factor, Function, Jacobian, Pose, Scalar, Vector};
use nalgebra::Vector3;

/// Predicted minus seen point [m] of a feature, along the camera's axes.
///
///   r = (Q C)⁻¹ P f - point
///
/// on (P = world_from_link that carries the feature, f = the feature in that link [m], Q = world_from_link that carries
/// the camera, C = link_from_camera). The world itself is a held identity in place of P or Q.
#[derive(Clone, Copy, Debug)]
pub struct PointObservation {
    /// Where the feature was seen in the camera's frame [m].
    pub point: [f64; 3],
}

impl Factor<3> for PointObservation {
    type On = (Pose, Vector<3>, Pose, Pose);

    fn residual<T: Scalar>(&self, on: (Pose<T>, Vector<3, T>, Pose<T>, Pose<T>)) -> [T; 3] {
        let predicted = InCamera.compute(on);
        std::array::from_fn(|k| predicted[k] - self.point[k])
    }

    /// The chain rule of rigid motion in place of dual numbers.
    #[inline]
    fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; 3] {
        let [carrier, mount, camera] = [x[0], x[2], x[3]].map(Pose::from_stored);
        let arm = carrier.rotation * Vector3::new(x[1][0], x[1][1], x[1][2]);
        let from_mount = arm + carrier.translation - mount.translation;
        let from_camera = mount.rotation.tr_mul(&from_mount) - camera.translation;
        let predicted = camera.rotation.tr_mul(&from_camera);
        if let Some(jacobian) = jacobian {
            for row in 0..3 {
                // The camera's axis: in the frame that carries the camera, in the world.
                let in_mount: Vector3<f64> = camera.rotation.column(row).into_owned();
                let in_world = mount.rotation * in_mount;
                if jacobian.wanted(0) {
                    write(jacobian.row(row, 0), arm.cross(&in_world), in_world);
                }
                if jacobian.wanted(1) {
                    jacobian.row(row, 1).copy_from_slice(carrier.rotation.tr_mul(&in_world).as_slice());
                }
                if jacobian.wanted(2) {
                    write(jacobian.row(row, 2), in_world.cross(&from_mount), -in_world);
                }
                if jacobian.wanted(3) {
                    write(jacobian.row(row, 3), in_mount.cross(&from_camera), -in_mount);
                }
            }
        }
        std::array::from_fn(|k| predicted[k] - self.point[k])
    }
}

/// A derived node: the feature in the camera's frame [m], on the same nodes.
#[derive(Clone, Copy, Debug)]
pub struct InCamera;

impl Function for InCamera {
    type On = (Pose, Vector<3>, Pose, Pose);
    type Output = Vector<3>;

    fn compute<T: Scalar>(
        &self,
        (carrier, feature, mount, camera): (Pose<T>, Vector<3, T>, Pose<T>, Pose<T>),
    ) -> Vector<3, T> {
        camera.inverse_transform(&mount.inverse_transform(&carrier.transform(&feature)))
    }
}
