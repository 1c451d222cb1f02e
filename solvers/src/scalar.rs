//! The number that residuals are written over: `f64`, or a dual number that carries derivatives along.
use nalgebra::RealField;
use num_dual::{DualNum, DualSVec64, DualStruct};
use std::ops::{Add, Div, Mul, Sub};

/// A real number, or one with first derivatives (forward-mode automatic differentiation).
///
/// A residual written once over `T: Scalar` gives its value with `T = f64` and its Jacobian with dual numbers.
/// All functions of `nalgebra::ComplexField` and `RealField` are there (`sin`, `sqrt`, `atan2`, ...), and plain `f64`
/// may stand on the right of an operator.
///
/// Where the real part is 0, `sqrt`, `norm`, `angle` and `atan2(0, 0)` have no derivative and give NaN, and
/// nalgebra's exponential and logarithm maps lose it in silence: use [`crate::manifold::so3`] for those.
pub trait Scalar:
    RealField
    + Copy
    + From<f64>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The value without its derivatives.
    fn value(&self) -> f64;
}

impl<T: RealField + Copy + DualNum<Primitive = f64> + From<f64>> Scalar for T {
    #[inline]
    fn value(&self) -> f64 {
        <T as DualStruct>::re(self)
    }
}

/// Directions that one pass of forward mode carries. Wider residuals take several passes: as fast as one wide
/// dual number, and no width needs to be known at compile time.
pub const LANES: usize = 10;

/// A number with derivatives in `N` directions.
pub type Dual<const N: usize = LANES> = DualSVec64<N>;

/// The variable of direction `lane`: derivative 1 there, 0 elsewhere.
#[inline]
pub fn seed<const N: usize>(value: f64, lane: usize) -> Dual<N> {
    Dual::<N>::from_re(value).derivative(lane)
}

/// The derivatives of a number in its `N` directions (0 where it is constant).
#[inline]
pub fn derivatives<const N: usize>(x: &Dual<N>) -> [f64; N] {
    x.eps.0.map_or([0.0; N], |d| d.data.0[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial<T: Scalar>(x: T, y: T) -> T {
        x * x * y + x.sin() * 2.0 - T::from(3.0) / y
    }

    #[test]
    fn derivatives_of_a_polynomial_are_those_of_the_textbook() {
        let (x, y) = (0.7, -1.3);
        let d = derivatives(&polynomial(seed::<LANES>(x, 0), seed::<LANES>(y, 1)));
        assert!((d[0] - (2.0 * x * y + 2.0 * x.cos())).abs() < 1e-14);
        assert!((d[1] - (x * x + 3.0 / (y * y))).abs() < 1e-14);
        assert_eq!(d[2..], [0.0; LANES - 2]);
    }
}
