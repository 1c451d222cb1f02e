//! R^n: a step is added.
use super::Variable;
use crate::Scalar;
use nalgebra::{DVector, SVector};

/// A vector of `N` numbers.
pub type Vector<const N: usize, T = f64> = SVector<T, N>;

impl<const N: usize> Variable for SVector<f64, N> {
    type Over<T: Scalar> = SVector<T, N>;

    fn ambient(&self) -> usize {
        N
    }

    fn tangent(&self) -> usize {
        N
    }

    #[inline]
    fn store(over: &Self, x: &mut [f64]) {
        x.copy_from_slice(over.as_slice());
    }

    #[inline]
    fn load(x: &[f64]) -> Self {
        SVector::from_column_slice(x)
    }

    #[inline]
    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> SVector<T, N> {
        SVector::from_fn(|i, _| delta(i) + x[i])
    }

    #[inline]
    fn local<T: Scalar>(x: &[f64], y: &SVector<T, N>, delta: &mut [T]) {
        for i in 0..N {
            delta[i] = y[i] - x[i];
        }
    }
}

/// A vector whose length is known at run time only.
pub type DynamicVector<T = f64> = DVector<T>;

impl Variable for DVector<f64> {
    type Over<T: Scalar> = DVector<T>;

    fn ambient(&self) -> usize {
        self.len()
    }

    fn tangent(&self) -> usize {
        self.len()
    }

    fn store(over: &Self, x: &mut [f64]) {
        x.copy_from_slice(over.as_slice());
    }

    fn load(x: &[f64]) -> Self {
        DVector::from_column_slice(x)
    }

    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> DVector<T> {
        DVector::from_fn(x.len(), |i, _| delta(i) + x[i])
    }

    fn local<T: Scalar>(x: &[f64], y: &DVector<T>, delta: &mut [T]) {
        for i in 0..x.len() {
            delta[i] = y[i] - x[i];
        }
    }
}
