//! A feature in the frame of a camera that sees it, and how it moves with everything between.
use handeye_solvers::{Function, Jacobian, Pose, Scalar, Vector};
use nalgebra::{Matrix3, Vector3};

/// A derived node: the feature in the camera's frame [m],
///
///   (Q C)⁻¹ P f
///
/// on (P = world_from_link that carries the feature, f = the feature in that link [m], Q = world_from_link that carries
/// the camera, C = link_from_camera). The world itself is a held identity in place of P or Q.
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

/// The same in numbers, with what the chain rule of rigid motion needs in place of dual numbers.
pub(super) struct Sightline {
    /// The feature in the camera's frame [m].
    pub in_camera: Vector3<f64>,
    carrier: Matrix3<f64>,
    mount: Matrix3<f64>,
    camera: Matrix3<f64>,
    /// From the carrier's origin to the feature, in the world.
    arm: Vector3<f64>,
    /// From the mount's origin to the feature, in the world.
    from_mount: Vector3<f64>,
    /// From the camera's origin to the feature, in the mount.
    from_camera: Vector3<f64>,
}

impl Sightline {
    /// Of stored values of P, f, Q and C.
    #[inline]
    pub fn new(x: &[&[f64]]) -> Self {
        let [carrier, mount, camera] = [x[0], x[2], x[3]].map(Pose::from_stored);
        let arm = carrier.rotation * Vector3::new(x[1][0], x[1][1], x[1][2]);
        let from_mount = arm + carrier.translation - mount.translation;
        let from_camera = mount.rotation.tr_mul(&from_mount) - camera.translation;
        Sightline {
            in_camera: camera.rotation.tr_mul(&from_camera),
            carrier: carrier.rotation,
            mount: mount.rotation,
            camera: camera.rotation,
            arm,
            from_mount,
            from_camera,
        }
    }

    /// Writes a row by P, f, Q and C, of something whose slope by the feature in the camera's frame is given.
    #[inline]
    pub fn write(&self, jacobian: &mut Jacobian<'_>, row: usize, slope: &Vector3<f64>) {
        // The slope by the feature in the frame that carries the camera, and in the world.
        let in_mount = self.camera * slope;
        let in_world = self.mount * in_mount;
        let pose = |columns: &mut [f64], w: Vector3<f64>, v: Vector3<f64>| {
            columns.copy_from_slice(&[w.x, w.y, w.z, v.x, v.y, v.z]);
        };
        if jacobian.wanted(0) {
            pose(jacobian.row(row, 0), self.arm.cross(&in_world), in_world);
        }
        if jacobian.wanted(1) {
            jacobian.row(row, 1).copy_from_slice(self.carrier.tr_mul(&in_world).as_slice());
        }
        if jacobian.wanted(2) {
            pose(jacobian.row(row, 2), in_world.cross(&self.from_mount), -in_world);
        }
        if jacobian.wanted(3) {
            pose(jacobian.row(row, 3), in_mount.cross(&self.from_camera), -in_mount);
        }
    }
}
