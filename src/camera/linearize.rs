//! A pixel and its derivatives by the point, for loops that know the camera.
use super::{CameraModel, PARAMETERS, perspective};
use handeye_solvers::Scalar;
use handeye_solvers::scalar::{Dual, derivatives, seed};
use nalgebra::Vector3;

impl CameraModel {
    /// Pixel [px] of a point in the camera frame [m], and the rows of its derivatives by the point [px/m].
    #[inline]
    pub fn linearize(
        self,
        parameters: &[f64; PARAMETERS],
        point_in_camera: &Vector3<f64>,
    ) -> ([f64; 2], [Vector3<f64>; 2]) {
        let [fx, fy, cx, cy, distortion @ ..] = parameters;
        if self == CameraModel::Pinhole && perspective::keeps_depth(point_in_camera) {
            let inverse = 1.0 / point_in_camera.z;
            let (x, y) = (point_in_camera.x * inverse, point_in_camera.y * inverse);
            let (p, q) = (fx * inverse, fy * inverse);
            let rows = [Vector3::new(p, 0.0, -p * x), Vector3::new(0.0, q, -q * y)];
            return ([fx * x + cx, fy * y + cy], rows);
        }
        let point = Vector3::from_fn(|i, _| seed::<3>(point_in_camera[i], i));
        let seen = self.lens(&distortion.map(Dual::<3>::from), &point);
        let ([x, y], [by_x, by_y]) = (seen.map(|value| value.value()), seen.map(|value| derivatives(&value)));
        ([fx * x + cx, fy * y + cy], [Vector3::from(by_x) * *fx, Vector3::from(by_y) * *fy])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tests::parameters;

    #[test]
    fn values_and_rows_agree_with_projections_of_moved_points() {
        for &model in CameraModel::ALL {
            let all = parameters(model);
            for point in [Vector3::new(0.3, -0.2, 1.1), Vector3::new(-0.9, 0.5, 0.8), Vector3::new(0.05, 0.02, 0.5)] {
                let (pixel, rows) = model.linearize(&all, &point);
                let [u, v] = model.project(&all, &point);
                assert!((pixel[0] - u).hypot(pixel[1] - v) < 1e-10, "{}", model.name());
                for i in 0..3 {
                    let moved = |s: f64| model.project(&all, &(point + Vector3::ith(i, s)));
                    let (high, low) = (moved(1e-7), moved(-1e-7));
                    for (k, row) in rows.iter().enumerate() {
                        let difference = (high[k] - low[k]) / 2e-7;
                        assert!((row[i] - difference).abs() < 1e-5 * (1.0 + difference.abs()), "{}", model.name());
                    }
                }
            }
        }
    }
}
