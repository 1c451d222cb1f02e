//! SO(3): rotations of space, moved by a rotation vector on the left.
use super::{Variable, so3};
use crate::Scalar;
use nalgebra::{Matrix3, Vector3};

/// A rotation, as its matrix. A step is a rotation vector in the parent frame: R ⊞ w = exp(w) R.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<T = f64>(pub Matrix3<T>);

impl<T: Scalar> Rotation<T> {
    /// The rotation that does nothing.
    pub fn identity() -> Self {
        Rotation(Matrix3::identity())
    }
}

impl Variable for Rotation {
    type Over<T: Scalar> = Rotation<T>;

    fn ambient(&self) -> usize {
        9
    }

    fn tangent(&self) -> usize {
        3
    }

    fn store(over: &Self, x: &mut [f64]) {
        x.copy_from_slice(so3::renormalize(&over.0).as_slice());
    }

    fn load(x: &[f64]) -> Self {
        Rotation(Matrix3::from_column_slice(x))
    }

    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Rotation<T> {
        let w = Vector3::new(delta(0), delta(1), delta(2));
        Rotation(so3::times(&so3::exp(&w), &lift(x)))
    }

    fn local<T: Scalar>(x: &[f64], y: &Rotation<T>, delta: &mut [T]) {
        let w = so3::log(&so3::times(&y.0, &lift::<T>(x).transpose()));
        delta[..3].copy_from_slice(w.as_slice());
    }
}

pub(super) fn lift<T: Scalar>(x: &[f64]) -> Matrix3<T> {
    Matrix3::from_fn(|i, j| T::from(x[i + 3 * j]))
}
