//! A chain from tip poses and joint readings alone, without a starting value (eq. 5).
//!
//! As products of exponentials, a chain's poses are P(j) = exp(ξ₁ j₁) ⋯ exp(ξₙ jₙ) P₀. Their rotations depend on the
//! directions of the axes alone, a small problem that random starts solve; given those, their translations are linear in
//! where the axes are. The rows of the chain's convention follow in closed form.
mod axes;
mod lines;
mod rows;

pub(crate) use axes::{Axes, find_axes};
pub(crate) use lines::{Lines, find_lines};
pub(crate) use rows::rows;
