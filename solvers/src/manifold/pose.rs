//! SE(3): rigid poses, a rotation and a translation moved side by side.
use super::rotation::lift;
use super::{Variable, so3};
use crate::Scalar;
use nalgebra::{Matrix3, Vector3};
use std::ops::Mul;

/// The pose of a child frame in its parent: maps child coordinates to parent coordinates, p ↦ R p + t.
///
/// Named `parent_from_child`, so that neighbouring names match: `world_from_tip = world_from_base * base_from_tip`.
/// A step is (w, v), six numbers: R ⊞ w = exp(w) R and t ⊞ v = t + v, both in the parent frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T = f64> {
    /// R, the child's axes in the parent.
    pub rotation: Matrix3<T>,
    /// t, the child's origin in the parent.
    pub translation: Vector3<T>,
}

impl<T: Scalar> Pose<T> {
    /// The pose of a frame in itself.
    #[inline]
    pub fn identity() -> Self {
        Pose { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }

    /// R p + t: a point of the child frame in the parent frame.
    #[inline]
    pub fn transform(&self, point: &Vector3<T>) -> Vector3<T> {
        so3::apply(&self.rotation, point) + self.translation
    }

    /// Rᵀ (p - t): a point of the parent frame in the child frame.
    #[inline]
    pub fn inverse_transform(&self, point: &Vector3<T>) -> Vector3<T> {
        so3::apply_transposed(&self.rotation, &(point - self.translation))
    }

    /// The pose of the parent in the child.
    #[inline]
    pub fn inverse(&self) -> Self {
        let translation = -so3::apply_transposed(&self.rotation, &self.translation);
        Pose { rotation: self.rotation.transpose(), translation }
    }
}

impl Pose {
    /// From a rotation vector and a translation.
    pub fn new(rotation_vector: Vector3<f64>, translation: Vector3<f64>) -> Self {
        Pose { rotation: so3::exp(&rotation_vector), translation }
    }

    /// The same pose with derivatives of zero.
    pub fn lift<T: Scalar>(&self) -> Pose<T> {
        Pose { rotation: self.rotation.map(T::from), translation: self.translation.map(T::from) }
    }

    /// Angle of the rotation to another pose, in [0, π] rad.
    pub fn angle_to(&self, other: &Pose) -> f64 {
        so3::log(&(other.rotation * self.rotation.transpose())).norm()
    }

    /// As stored in a graph: R by columns, then t.
    #[inline]
    pub fn from_stored(x: &[f64]) -> Self {
        Pose { rotation: Matrix3::from_column_slice(&x[..9]), translation: Vector3::new(x[9], x[10], x[11]) }
    }

    /// Writes what [`Pose::from_stored`] reads.
    #[inline]
    pub fn write_stored(&self, x: &mut [f64]) {
        x[..9].copy_from_slice(self.rotation.as_slice());
        x[9..12].copy_from_slice(self.translation.as_slice());
    }
}

impl<T: Scalar> Mul for Pose<T> {
    type Output = Self;

    #[inline]
    #[allow(clippy::suspicious_arithmetic_impl)] // R₁ t₂ + t₁
    fn mul(self, other: Self) -> Self {
        Pose {
            rotation: so3::times(&self.rotation, &other.rotation),
            translation: so3::apply(&self.rotation, &other.translation) + self.translation,
        }
    }
}

impl Variable for Pose {
    type Over<T: Scalar> = Pose<T>;

    fn ambient(&self) -> usize {
        12
    }

    fn tangent(&self) -> usize {
        6
    }

    fn store(over: &Self, x: &mut [f64]) {
        Pose { rotation: so3::renormalize(&over.rotation), translation: over.translation }.write_stored(x);
    }

    #[inline]
    fn load(x: &[f64]) -> Self {
        Pose::from_stored(x)
    }

    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Pose<T> {
        let w = Vector3::new(delta(0), delta(1), delta(2));
        Pose {
            rotation: so3::times(&so3::exp(&w), &lift(x)),
            translation: Vector3::from_fn(|i, _| delta(3 + i) + x[9 + i]),
        }
    }

    fn local<T: Scalar>(x: &[f64], y: &Pose<T>, delta: &mut [T]) {
        let w = so3::log(&so3::times(&y.rotation, &lift::<T>(x).transpose()));
        delta[..3].copy_from_slice(w.as_slice());
        for i in 0..3 {
            delta[3 + i] = y.translation[i] - x[9 + i];
        }
    }

    /// (I + K) R with K v = w × v, which has the derivative of exp(w) R at w = 0 for a third of the work.
    #[inline]
    fn seed<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Pose<T> {
        let w = [delta(0), delta(1), delta(2)];
        let row = |i: usize, j: usize| {
            let (k, l) = ((i + 1) % 3, (i + 2) % 3);
            w[k] * x[l + 3 * j] - w[l] * x[k + 3 * j] + x[i + 3 * j]
        };
        Pose { rotation: Matrix3::from_fn(row), translation: Vector3::from_fn(|i, _| delta(3 + i) + x[9 + i]) }
    }
}
