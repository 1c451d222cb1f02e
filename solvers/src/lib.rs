//! Factor graphs on manifolds with forward-mode automatic differentiation, and the solvers that minimise them.
//!
//! Knows no robot, no camera and no file: see the crate `handeye` for those.
mod accumulate;
pub mod check;
mod covariance;
mod derivative;
mod eigen;
mod error;
mod factor;
mod gauss_newton;
mod graduated;
mod graph;
mod jacobian;
mod layout;
mod lbfgs;
mod levenberg_marquardt;
pub mod linear;
mod loss;
pub mod manifold;
mod noise;
mod pool;
mod report;
pub mod scalar;
mod substitute;
mod tangent;
mod variables;
mod weak_directions;
mod workspace;

pub use covariance::Covariance;
pub use error::Error;
pub use factor::{Factor, Function};
pub use gauss_newton::GaussNewton;
pub use graduated::Graduated;
pub use graph::{FactorKey, FactorSettings, Graph};
pub use jacobian::Jacobian;
pub use lbfgs::{Lbfgs, Minibatches};
pub use levenberg_marquardt::{LevenbergMarquardt, Solver};
pub use loss::Loss;
pub use manifold::{Direction, DynamicVector, Pose, Rotation, Variable, Vector};
pub use nalgebra;
pub use noise::Noise;
pub use report::{Iteration, Observer, Report, Termination};
pub use scalar::Scalar;
pub use variables::{Key, Variables};
pub use weak_directions::{Component, WeakDirection, Weakness};
pub use workspace::Workspace;
