//! Tasks in images: points, lines and conics that shall meet, composed from named features, and what a composition leaves open.
//!
//! An [`ImageTask`] turns what trackers see into rows of errors in pixels, each with its standard deviation, for
//! [`crate::servo::uncalibrated::Uncalibrated`] or any other controller. [`check()`] says before anything moves which degrees of freedom it
//! fixes, which motions stay free, and where else it may end. After Ramirez, "Towards Practical Uncalibrated Visual Servoing", 2016,
//! chapter 3, and Dodds et al., "Task specification and monitoring for uncalibrated hand/eye coordination", 1999.
pub mod catalog;
mod check;
mod conic;
mod drawn;
mod feature;
mod geometry;
mod in_rig;
mod kind;
mod line;
mod line_angle;
mod line_to_line;
mod parallel_lines;
mod point_to_conic;
mod point_to_line;
mod point_to_point;
mod point_to_point_3d;
mod read;
mod seen;
mod task;

pub use check::{Alternative, CheckSettings, Displacement, FreeMotions, Motion, TaskCheck, Weakest, check};
pub use feature::{Feature, Place};
pub use geometry::{Geometry, View};
pub(crate) use in_rig::{Found, InRig};
pub use kind::Kind;
pub use line_angle::LineAngle;
pub use line_to_line::LineToLine;
pub use parallel_lines::ParallelLines;
pub use point_to_conic::PointToConic;
pub use point_to_line::PointToLine;
pub use point_to_point::PointToPoint;
pub use point_to_point_3d::PointToPoint3d;
pub use seen::Seen;
pub use task::{ImageTask, Part, RowError, Trackers};
