//! The reprojection error of one feature in one image (eqs. 2 and 6 of the paper).
use super::InCamera;
use super::in_camera::Sightline;
use crate::camera::{CameraModel, PARAMETERS};
use handeye_solvers::scalar::{Dual, derivatives, seed};
use handeye_solvers::{Factor, Function, Jacobian, Pose, Scalar, Vector};
use nalgebra::Vector3;

/// fx, fy, cx, cy [px] and 8 distortion coefficients, of which a camera model uses the first few.
pub type Intrinsics = Vector<PARAMETERS>;

/// Predicted minus seen pixel [px] of a feature.
///
///   r = project(K, (Q C)⁻¹ P f) - pixel
///
/// on (P = world_from_link that carries the feature, f = the feature in that link [m], Q = world_from_link that carries
/// the camera, C = link_from_camera, K = intrinsics). The world itself is a held identity in place of P or Q.
#[derive(Clone, Copy, Debug)]
pub struct Reprojection {
    /// Where the feature was seen [px].
    pub pixel: [f64; 2],
    /// The camera's lens model.
    pub model: CameraModel,
}

impl Factor<2> for Reprojection {
    type On = (Pose, Vector<3>, Pose, Pose, Intrinsics);

    fn residual<T: Scalar>(
        &self,
        (carrier, feature, mount, camera, intrinsics): (Pose<T>, Vector<3, T>, Pose<T>, Pose<T>, Vector<PARAMETERS, T>),
    ) -> [T; 2] {
        let in_camera = InCamera.compute((carrier, feature, mount, camera));
        let [u, v] = self.model.project(&intrinsics.data.0[0], &in_camera);
        [u - self.pixel[0], v - self.pixel[1]]
    }

    /// Dual numbers through the lens only; the rest is the chain rule of rigid motion.
    #[inline]
    fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; 2] {
        let sightline = Sightline::new(x);
        let in_camera = sightline.in_camera;
        let [fx, fy, cx, cy] = [x[4][0], x[4][1], x[4][2], x[4][3]];
        let distortion = &x[4][4..];
        let pixel = |[a, b]: [f64; 2]| [fx * a + cx - self.pixel[0], fy * b + cy - self.pixel[1]];
        let Some(jacobian) = jacobian else {
            return pixel(self.model.lens(distortion, &in_camera));
        };
        let coefficients = self.model.distortion().len();
        let bends = (0..coefficients).any(|k| jacobian.wanted_coordinate(4, 4 + k));
        let mut by_distortion = [[0.0; 8]; 2];
        let (seen, by_point) = if bends {
            let (seen, slopes) = lens::<11>(self.model, distortion, &in_camera);
            by_distortion = slopes.map(|slope| std::array::from_fn(|k| slope[3 + k]));
            (seen, slopes.map(|slope| [slope[0], slope[1], slope[2]]))
        } else {
            lens::<3>(self.model, &distortion[..coefficients], &in_camera)
        };
        for (row, focal) in [fx, fy].into_iter().enumerate() {
            let [a, b, c] = by_point[row].map(|slope| focal * slope);
            sightline.write(jacobian, row, &Vector3::new(a, b, c));
            if jacobian.wanted(4) {
                let columns = jacobian.row(row, 4);
                columns.copy_from_slice(&[0.0; PARAMETERS]);
                columns[row] = seen[row];
                columns[2 + row] = 1.0;
                if bends {
                    for (column, slope) in columns[4..].iter_mut().zip(by_distortion[row]) {
                        *column = focal * slope;
                    }
                }
            }
        }
        pixel(seen)
    }
}

/// The lens and its derivatives by the point and, where `N` is 11, by the distortion coefficients.
#[inline]
fn lens<const N: usize>(model: CameraModel, distortion: &[f64], in_camera: &Vector3<f64>) -> ([f64; 2], [[f64; N]; 2]) {
    let point = Vector3::new(seed::<N>(in_camera.x, 0), seed::<N>(in_camera.y, 1), seed::<N>(in_camera.z, 2));
    let lifted = if distortion.is_empty() {
        model.lens(&[], &point)
    } else {
        let mut coefficients = [Dual::<N>::from(0.0); 8];
        for (k, (lifted, &value)) in coefficients.iter_mut().zip(distortion).enumerate() {
            *lifted = if N == 11 { seed::<N>(value, 3 + k) } else { Dual::from(value) };
        }
        model.lens(&coefficients, &point)
    };
    (lifted.map(|value| value.value()), lifted.map(|value| derivatives(&value)))
}
