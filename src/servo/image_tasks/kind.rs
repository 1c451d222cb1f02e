//! The kinds of errors: one file each, and a line in the list below.
use super::{
    line_angle, line_to_line, parallel_lines, point_to_conic, point_to_line, point_to_point, point_to_point_3d,
};
use handeye_solvers::Scalar;
use nalgebra::Vector3;

macro_rules! kinds {
    ($($(#[$attribute:meta])* $kind:ident => $file:ident,)*) => {
        /// What shall meet what.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Kind {
            $($(#[$attribute])* $kind($file::$kind),)*
        }

        impl Kind {
            /// The words of task files.
            pub const NAMES: &'static [&'static str] = &[$($file::NAME),*];

            /// Its name in task files.
            pub fn name(&self) -> &'static str {
                match self { $(Kind::$kind(_) => $file::NAME,)* }
            }

            /// Rows of errors that it makes per camera.
            pub fn rows(&self) -> usize {
                match self { $(Kind::$kind(_) => $file::$kind::ROWS,)* }
            }

            /// The features that it is about, by index among the task's.
            pub fn features(&self) -> Vec<usize> {
                match self { $(Kind::$kind(kind) => kind.features(),)* }
            }

            /// Adds the rows of its errors [px], of features in the order of [`Kind::features`]: homogeneous pixels (u, v, 1), or the points
            /// in the camera's frame [m] where it [`Kind::is_spatial`].
            pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
                match self { $(Kind::$kind(kind) => kind.errors(seen, errors),)* }
            }
        }
    };
}

kinds! {
    /// A point on a point.
    PointToPoint => point_to_point,
    /// A point on a line.
    PointToLine => point_to_line,
    /// A line on a line.
    LineToLine => line_to_line,
    /// A line parallel to another.
    ParallelLines => parallel_lines,
    /// A line at an angle.
    LineAngle => line_angle,
    /// A point on a conic.
    PointToConic => point_to_conic,
    /// A point on a point in space.
    PointToPoint3d => point_to_point_3d,
}

impl Kind {
    /// True where it compares points in space and not pixels.
    pub fn is_spatial(&self) -> bool {
        matches!(self, Kind::PointToPoint3d(_))
    }

    /// What is wrong with it by itself; `None` where it is fine.
    pub(super) fn problem(&self) -> Option<String> {
        match self {
            Kind::PointToConic(kind) if kind.conic.len() < 5 => {
                Some(format!("a conic of {} points; 5 or more determine one", kind.conic.len()))
            }
            Kind::LineAngle(kind) if !kind.angle.is_finite() => Some(format!("an angle of {} rad", kind.angle)),
            Kind::PointToPoint3d(kind) if !(kind.px_per_metre > 0.0 && kind.px_per_metre.is_finite()) => {
                Some(format!("`px_per_metre` is {}; it has to be above 0", kind.px_per_metre))
            }
            _ => None,
        }
    }
}
