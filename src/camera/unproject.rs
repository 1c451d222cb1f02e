//! The way back: a pixel to the direction that it was seen in.
use super::{CameraModel, PARAMETERS};
use handeye_solvers::Scalar;
use handeye_solvers::scalar::{derivatives, seed};
use nalgebra::Vector3;

/// Newton iterations per attempt; a lens that can be inverted needs 3 to 6.
const ITERATIONS: usize = 20;

/// Largest remaining error in normalised coordinates: a millionth of a pixel at a focal length of 1000 px.
const CONVERGED: f64 = 1e-9;

/// Points between the axis and the solution at which the lens must not have folded back.
const CHECKS: usize = 8;

/// Steps from the axis outwards where Newton's method does not get there in one.
const CONTINUATION: usize = 20;

impl CameraModel {
    /// Unit direction, in the camera frame, of the points that are seen at a pixel [px].
    ///
    /// Newton's method on the lens. `None` where no direction has that pixel, or only one beyond the angle at which the
    /// distortion folds back (there, its Jacobian changes sign and the formula no longer describes a lens).
    pub fn unproject(self, parameters: &[f64; PARAMETERS], pixel: [f64; 2]) -> Option<Vector3<f64>> {
        let [fx, fy, cx, cy, distortion @ ..] = parameters;
        let target = [(pixel[0] - cx) / fx, (pixel[1] - cy) / fy];
        if self == CameraModel::Pinhole {
            let ray = Vector3::new(target[0], target[1], 1.0);
            return target.iter().all(|number| number.is_finite()).then(|| ray / ray.norm());
        }
        let direct = self.newton(distortion, target, target).filter(|&chart| self.is_unfolded(distortion, chart));
        let chart = direct.or_else(|| self.follow(distortion, target))?;
        let ray = self.ray(chart);
        Some(ray / ray.norm())
    }

    /// Solves lens(ray(chart)) = target from a start.
    fn newton(self, distortion: &[f64], target: [f64; 2], start: [f64; 2]) -> Option<[f64; 2]> {
        let mut chart = start;
        for _ in 0..ITERATIONS {
            let ([x, y], [[a, b], [c, d]]) = self.lens_on_chart(distortion, chart);
            let (ex, ey) = (target[0] - x, target[1] - y);
            let determinant = a * d - b * c;
            let step = [(d * ex - b * ey) / determinant, (a * ey - c * ex) / determinant];
            chart = [chart[0] + step[0], chart[1] + step[1]];
            if !(chart[0].is_finite() && chart[1].is_finite()) {
                return None;
            }
            // The error is now of the order of the step squared: Newton has converged, and this was its last step.
            if ex.hypot(ey) < CONVERGED && step[0].hypot(step[1]) < CONVERGED {
                return self.is_on_chart(chart).then_some(chart);
            }
        }
        None
    }

    /// Solves for targets from the centre outwards, each from the one before, as long as the lens does not fold back.
    fn follow(self, distortion: &[f64], target: [f64; 2]) -> Option<[f64; 2]> {
        (1..=CONTINUATION).try_fold([0.0; 2], |chart, i| {
            let t = i as f64 / CONTINUATION as f64;
            self.newton(distortion, [t * target[0], t * target[1]], chart)
                .filter(|&next| self.is_unfolded(distortion, next))
        })
    }

    /// True where the Jacobian keeps its sign from the axis to here.
    fn is_unfolded(self, distortion: &[f64], chart: [f64; 2]) -> bool {
        (0..=CHECKS).all(|i| {
            let t = i as f64 / CHECKS as f64;
            let (_, [[a, b], [c, d]]) = self.lens_on_chart(distortion, [t * chart[0], t * chart[1]]);
            // A fold along the radius alone is enough: both principal stretches must stay positive.
            a * d - b * c > 0.0 && a + d > 0.0
        })
    }

    /// A fisheye's chart is an angle: beyond half a turn it would come round again.
    fn is_on_chart(self, chart: [f64; 2]) -> bool {
        let back = self.lens(&[], &self.ray(chart));
        (back[0] - chart[0]).hypot(back[1] - chart[1]) <= 1e-6 * (1.0 + chart[0].hypot(chart[1]))
    }

    /// The lens and its 2 x 2 Jacobian, by rows, over the chart.
    fn lens_on_chart(self, distortion: &[f64], chart: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let mut constants = [seed::<2>(0.0, 0); 8];
        for (constant, &value) in constants.iter_mut().zip(distortion) {
            *constant = value.into();
        }
        let ray = self.ray([seed::<2>(chart[0], 0), seed::<2>(chart[1], 1)]);
        let pixel = self.lens(&constants, &ray);
        (pixel.map(|v| v.value()), [derivatives(&pixel[0]), derivatives(&pixel[1])])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tests::parameters;

    #[test]
    fn a_pixel_goes_back_to_the_direction_that_it_came_from() {
        for &model in CameraModel::ALL {
            let all = parameters(model);
            let widest = if model == CameraModel::KannalaBrandt { 100 } else { 50 };
            for degrees in (0..=widest).step_by(5) {
                let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
                for turn in 0..7 {
                    let (y, x) = f64::from(turn).sin_cos();
                    let ray = Vector3::new(x * sine, y * sine, cosine);
                    let back = model.unproject(&all, model.project(&all, &(ray * 3.0)));
                    let error = back.map_or(f64::NAN, |back| (back - ray).norm());
                    assert!(error < 1e-12, "{} at {degrees}: {error}", model.name());
                    assert!(model.is_in_front(&ray));
                }
            }
        }
    }

    // x' = x (1 - 0.3 x²) is largest at x = 1.054, where x' = 0.7027: 741.6 px at a focal length of 600 px.
    #[test]
    fn nothing_is_seen_beyond_the_pixel_where_the_lens_folds_back() {
        let all = [600.0, 600.0, 320.0, 240.0, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let model = CameraModel::BrownConrady;
        assert!(model.unproject(&all, [741.0, 240.0]).is_some_and(|ray| ray.x / ray.z < 1.0541));
        assert_eq!(model.unproject(&all, [742.0, 240.0]), None);
        assert_eq!(model.unproject(&all, [5e3, 5e3]), None);
        assert_eq!(model.unproject(&all, [f64::NAN, 240.0]), None);
    }

    #[test]
    fn a_fisheye_sees_nothing_beyond_half_a_turn() {
        let mut all = parameters(CameraModel::Pinhole);
        all[0] = 100.0;
        let model = CameraModel::KannalaBrandt;
        assert!(model.unproject(&all, [320.0 + 313.0, 240.0]).is_some_and(|ray| ray.z < -0.99));
        assert_eq!(model.unproject(&all, [320.0 + 316.0, 240.0]), None);
    }
}
