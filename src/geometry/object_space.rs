//! The error of a pose in object space: how far points are from the rays that they are seen along.
//!
//! As in SQPnP (Terzakis and Lourakis 2020) the translation is eliminated, which leaves a quadratic form in the nine elements of the
//! rotation; rays that do not meet in one point add a linear term to it.
use super::rotation::nearest_rotation;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

type Matrix9 = SMatrix<f64, 9, 9>;
type Matrix3x9 = SMatrix<f64, 3, 9>;
type Vector9 = SVector<f64, 9>;

/// Iterations from one start; minima are isolated, and refined again afterwards.
const ITERATIONS: usize = 20;

/// Eigenvectors of Ω that serve as starts.
const EIGENVECTORS: usize = 4;

/// Two rotations closer than this (Frobenius norm) are one solution.
pub(super) const SAME: f64 = 1e-3;

/// A descent that comes so near to a minimum (Frobenius norm, 4°) ends there.
const NEAR: f64 = 0.1;

/// Squared step [rad²] at which a descent has arrived.
const ARRIVED: f64 = 1e-10;

/// Least eigenvalue, relative to the mean one, that the linear solution is not disturbed by.
const RIDGE: f64 = 1e-6;

/// Σ |Q (R p + t - c)|² with Q = I - b bᵀ, b the unit direction of a point's ray and c a point on the ray.
///
/// With r the rotation by columns and the best translation t = T r + t₀ it is rᵀ Ω r + 2 βᵀ r + constant. Rays that meet at the
/// origin, those of one camera, have β = 0 and t₀ = 0.
pub(super) struct ObjectSpace {
    omega: Matrix9,
    beta: Vector9,
    translation: Matrix3x9,
    offset: Vector3<f64>,
}

impl ObjectSpace {
    /// `origins`: by point, or none where all are the origin. `None` where the rays are all parallel, or not finite.
    pub fn new(points: &[Vector3<f64>], origins: &[Vector3<f64>], directions: &[Vector3<f64>]) -> Option<Self> {
        let (mut omega, mut linear, mut total) = (Matrix9::zeros(), Matrix3x9::zeros(), Matrix3::zeros());
        let (mut beta, mut pull) = (Vector9::zeros(), Vector3::zeros());
        for (index, (p, b)) in points.iter().zip(directions).enumerate() {
            // R p = A r.
            let q = Matrix3::identity() - b * b.transpose();
            for i in 0..3 {
                let scaled = q * p[i];
                let mut columns = linear.fixed_view_mut::<3, 3>(0, 3 * i);
                columns += scaled;
                for j in 0..=i {
                    let mut block = omega.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    block += scaled * p[j];
                }
            }
            if let Some(c) = origins.get(index) {
                let across = q * c;
                pull += across;
                for i in 0..3 {
                    let mut rows = beta.fixed_rows_mut::<3>(3 * i);
                    rows -= across * p[i];
                }
            }
            total += q;
        }
        omega.fill_upper_triangle_with_lower_triangle();
        let inverse = total.cholesky()?.inverse();
        let (translation, offset) = (-(inverse * linear), inverse * pull);
        omega += linear.transpose() * translation;
        beta += linear.transpose() * offset;
        let finite = omega.iter().chain(&beta).all(|v| v.is_finite());
        finite.then_some(ObjectSpace { omega, beta, translation, offset })
    }

    pub fn translation(&self, rotation: &Matrix3<f64>) -> Vector3<f64> {
        self.translation * Vector9::from_column_slice(rotation.as_slice()) + self.offset
    }

    /// The pose with its best translation.
    pub fn pose(&self, rotation: Matrix3<f64>) -> Pose {
        Pose { rotation, translation: self.translation(&rotation) }
    }

    /// Local minima over all rotations, each once.
    pub fn minima(&self) -> Vec<Matrix3<f64>> {
        let mut found: Vec<Matrix3<f64>> = Vec::new();
        for start in self.starts() {
            let Some(minimum) = self.descend(start, &found) else { continue };
            if found.iter().all(|other| (other - minimum).norm() > SAME) {
                found.push(minimum);
            }
        }
        found
    }

    /// The minimum near the rotation that is nearest to the least r of all matrices: the least of all where the rays come from
    /// several places. `None` where they come from one.
    pub fn linear(&self) -> Option<Matrix3<f64>> {
        let ridge = RIDGE * self.omega.trace() / 9.0;
        let r = -(self.omega + Matrix9::identity() * ridge).cholesky()?.solve(&self.beta);
        let start = nearest_rotation(&Matrix3::from_column_slice(r.as_slice()))?;
        self.descend(start, &[])
    }

    /// The rotations nearest to the flattest directions of Ω, then the 24 of a cube: none is farther than 63° from one.
    fn starts(&self) -> Vec<Matrix3<f64>> {
        let mut starts = Vec::new();
        if let Some(eigen) = self.omega.try_symmetric_eigen(f64::EPSILON, 200) {
            let mut order: Vec<usize> = (0..9).collect();
            order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
            for &k in &order[..EIGENVECTORS] {
                let matrix = Matrix3::from_column_slice(eigen.eigenvectors.column(k).as_slice());
                starts.extend([matrix, -matrix].iter().filter_map(nearest_rotation));
            }
        }
        for [i, j] in [[0, 1], [1, 2], [2, 0], [0, 2], [2, 1], [1, 0]] {
            for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                let (x, y) = (Vector3::ith(i, s), Vector3::ith(j, t));
                starts.push(Matrix3::from_columns(&[x, y, x.cross(&y)]));
            }
        }
        starts
    }

    /// Levenberg-Marquardt on SO(3); `None` where it does not arrive, or comes to one of the minima that are known.
    fn descend(&self, mut rotation: Matrix3<f64>, known: &[Matrix3<f64>]) -> Option<Matrix3<f64>> {
        let vector = |r: &Matrix3<f64>| Vector9::from_column_slice(r.as_slice());
        let look = |r: &Matrix3<f64>| {
            let (at, turned) = (vector(r), self.omega * vector(r));
            (turned + self.beta, at.dot(&turned) + 2.0 * at.dot(&self.beta))
        };
        let (mut gradient9, mut cost) = look(&rotation);
        let mut lambda = 1e-4;
        for _ in 0..ITERATIONS {
            // d vec(exp(w) R) = J dw, with eₖ × (columns of R) as the columns of J.
            let tangent = |k: usize| vector(&(so3::cross_matrix(&Vector3::ith(k, 1.0)) * rotation));
            let jacobian = SMatrix::<f64, 9, 3>::from_columns(&[tangent(0), tangent(1), tangent(2)]);
            let mut hessian = jacobian.transpose() * (self.omega * jacobian);
            let damping = lambda * hessian.trace();
            (0..3).for_each(|k| hessian[(k, k)] += damping);
            let step = -hessian.cholesky()?.solve(&(jacobian.transpose() * gradient9));
            let next = so3::renormalize(&(so3::exp(&step) * rotation));
            let (next_gradient, next_cost) = look(&next);
            if next_cost < cost {
                (rotation, gradient9, cost, lambda) = (next, next_gradient, next_cost, lambda * 0.1);
                if known.iter().any(|minimum| (minimum - rotation).norm_squared() < NEAR * NEAR) {
                    return None;
                }
            } else {
                lambda *= 10.0;
            }
            if step.norm_squared() < ARRIVED {
                return Some(rotation);
            }
        }
        Some(rotation)
    }
}
