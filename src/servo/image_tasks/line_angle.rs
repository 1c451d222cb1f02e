//! A line shall have an angle in the image.
use super::line::{difference, turned};
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "line-angle";

/// The sine of what a line's angle is off times the length of its segment, one row [px].
#[derive(Clone, Debug, PartialEq)]
pub struct LineAngle {
    /// Two points of the line, by index among the task's features.
    pub line: [usize; 2],
    /// The angle, from the direction of u towards that of v [rad].
    pub angle: f64,
    /// True where the line shall point there, from its first point to its second: twice the length times the sine of half the angle.
    pub directed: bool,
}

impl LineAngle {
    pub(super) const ROWS: usize = 1;

    pub(super) fn features(&self) -> Vec<usize> {
        self.line.to_vec()
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        let along = [self.angle.cos(), self.angle.sin()].map(T::from);
        errors.push(turned(along, difference(&seen[0], &seen[1]), self.directed));
    }
}
