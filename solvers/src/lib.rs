//! Factor graphs on manifolds with forward-mode automatic differentiation, and the solvers that minimise them.
//!
//! Knows no robot, no camera and no file: see the crate `handeye` for those.
mod error;
pub mod manifold;
pub mod scalar;

pub use error::Error;
pub use manifold::{Direction, DynamicVector, Pose, Rotation, Variable, Vector};
pub use nalgebra;
pub use scalar::Scalar;
