//! The one interface of everything that can be estimated.
use crate::Scalar;

/// A point on a manifold: stored in `ambient` numbers, moved by a step of `tangent` numbers.
///
/// `retract` is x ⊞ δ and `local` its inverse, y ⊟ x, with x ⊞ (y ⊟ x) = y and (x ⊞ δ) ⊟ x = δ for small δ.
/// [`crate::check::variable`] tests both, and their derivatives, for a variable of your own.
pub trait Variable: Clone + Send + Sync + 'static {
    /// The same thing over another scalar; over `f64` it is the variable itself.
    type Over<T: Scalar>;

    /// How many numbers it is stored in.
    fn ambient(&self) -> usize;

    /// How many numbers a step has.
    fn tangent(&self) -> usize;

    /// Writes it to `x`, which has `ambient` places.
    fn store(over: &Self::Over<f64>, x: &mut [f64]);

    /// Reads it back.
    fn load(x: &[f64]) -> Self;

    /// x ⊞ δ, where `x` is as stored and `delta(i)` is the i-th number of the step.
    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Self::Over<T>;

    /// y ⊟ x, the step from the stored `x` to `y`, written to `delta`.
    fn local<T: Scalar>(x: &[f64], y: &Self::Over<T>, delta: &mut [T]);

    /// x ⊞ δ to first order at δ = 0, where forward mode evaluates it: a cheaper formula may stand here.
    #[inline]
    fn seed<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Self::Over<T> {
        Self::retract(x, delta)
    }
}
