//! How far known points are from where they are seen, and the pose that brings them nearest.
//!
//! The distance of a point q in the camera's frame from a bearing b is |q / |q| - b| [rad, for small angles].
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Most Levenberg-Marquardt iterations; 3 to 8 are the rule.
const ITERATIONS: usize = 25;

/// Relative decrease of the cost at which refining stops.
const CONVERGED: f64 = 1e-12;

/// Least ratio of the extreme eigenvalues of the normal equations at which the pose counts as determined.
const DETERMINED: f64 = 1e-13;

/// |q / |q| - b|² [rad²].
#[inline]
pub(super) fn squared_distance(camera: &Pose, point: &Vector3<f64>, bearing: &Vector3<f64>) -> f64 {
    let q = camera.transform(point);
    (q / q.norm().max(f64::MIN_POSITIVE) - bearing).norm_squared()
}

/// The pose `camera_from_points` that minimises the sum of squared distances of some of the points, from a start, and
/// that sum. `None` where they leave the pose open.
pub(super) fn refine(
    start: &Pose,
    points: &[Vector3<f64>],
    bearings: &[Vector3<f64>],
    chosen: &[usize],
) -> Option<(Pose, f64)> {
    let mut pose = *start;
    let mut normal = Normal::new(&pose, points, bearings, chosen);
    let mut lambda = 1e-6;
    for _ in 0..ITERATIONS {
        let mut damped = normal.hessian;
        (0..6).for_each(|k| damped[(k, k)] += lambda * normal.hessian[(k, k)]);
        let step = -damped.cholesky()?.solve(&normal.gradient);
        let next = Pose {
            rotation: so3::renormalize(&(so3::exp(&step.fixed_rows::<3>(0).into_owned()) * pose.rotation)),
            translation: pose.translation + step.fixed_rows::<3>(3),
        };
        let tried = Normal::new(&next, points, bearings, chosen);
        if tried.cost < normal.cost {
            let done = normal.cost - tried.cost < CONVERGED * normal.cost;
            (pose, normal, lambda) = (next, tried, lambda * 0.1);
            if done {
                break;
            }
        } else if tried.cost <= normal.cost * (1.0 + 1e-12) || lambda > 1e6 {
            break;
        } else {
            lambda *= 10.0;
        }
    }
    // Scaled to a unit diagonal, so that the unit of length does not count.
    let scale = normal.hessian.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = normal.hessian.component_mul(&(scale * scale.transpose()));
    let eigenvalues = scaled.try_symmetric_eigen(f64::EPSILON, 100)?.eigenvalues;
    (eigenvalues.min() > DETERMINED * eigenvalues.max()).then_some((pose, normal.cost))
}

/// Normal equations of the sum of squared distances, in `Pose`'s own step.
struct Normal {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
}

impl Normal {
    fn new(pose: &Pose, points: &[Vector3<f64>], bearings: &[Vector3<f64>], chosen: &[usize]) -> Self {
        let (mut ww, mut wv, mut vv) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        let (mut gw, mut gv, mut cost) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for &i in chosen {
            let turned = pose.rotation * points[i];
            let q = turned + pose.translation;
            let inverse = 1.0 / q.norm().max(f64::MIN_POSITIVE);
            let direction = q * inverse;
            // With P = I - u uᵀ: dr = P dq / |q| and dq = dv - [R p] dw; PᵀP = P.
            let p = (Matrix3::identity() - direction * direction.transpose()) * (inverse * inverse);
            let lever = so3::cross_matrix(&turned);
            let across = (direction * direction.dot(&bearings[i]) - bearings[i]) * inverse;
            let p_lever = p * lever;
            vv += p;
            wv += lever * p;
            ww -= lever * p_lever;
            gv += across;
            gw += turned.cross(&across);
            cost += (direction - bearings[i]).norm_squared();
        }
        let mut hessian = Matrix6::zeros();
        hessian.fixed_view_mut::<3, 3>(0, 0).copy_from(&ww);
        hessian.fixed_view_mut::<3, 3>(0, 3).copy_from(&wv);
        hessian.fixed_view_mut::<3, 3>(3, 0).copy_from(&wv.transpose());
        hessian.fixed_view_mut::<3, 3>(3, 3).copy_from(&vv);
        Normal { hessian, gradient: Vector6::new(gw.x, gw.y, gw.z, gv.x, gv.y, gv.z), cost }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::Random;

    #[test]
    fn normal_equations_agree_with_differences() {
        let mut random = Random::new(2);
        let pose = Pose::new(random.vector(0.5), random.vector(0.5) + Vector3::z() * 3.0);
        let points: Vec<_> = (0..8).map(|_| random.vector(1.0)).collect();
        let bearings: Vec<_> = points.iter().map(|p| random.tilted(&pose.transform(p).normalize(), 0.05)).collect();
        let chosen: Vec<_> = (0..8).collect();
        let residuals = |step: Vector6<f64>| -> Vec<f64> {
            let moved = Pose {
                rotation: so3::exp(&Vector3::new(step[0], step[1], step[2])) * pose.rotation,
                translation: pose.translation + Vector3::new(step[3], step[4], step[5]),
            };
            let residual = |(p, b): (&Vector3<f64>, &Vector3<f64>)| moved.transform(p).normalize() - b;
            points.iter().zip(&bearings).flat_map(|pair| residual(pair).as_slice().to_vec()).collect()
        };
        let h = 1e-6;
        let column = |k: usize| -> Vec<f64> {
            let (high, low) = (residuals(Vector6::ith(k, h)), residuals(Vector6::ith(k, -h)));
            high.iter().zip(&low).map(|(x, y)| (x - y) / (2.0 * h)).collect()
        };
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let normal = Normal::new(&pose, &points, &bearings, &chosen);
        for i in 0..6 {
            assert!((normal.gradient[i] - dot(&column(i), &residuals(Vector6::zeros()))).abs() < 1e-8);
            for j in 0..6 {
                assert!((normal.hessian[(i, j)] - dot(&column(i), &column(j))).abs() < 1e-8);
            }
        }
    }
}
