//! A line shall be parallel to another in the image.
use super::line::{difference, turned, unit};
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "parallel-lines";

/// e_par: the sine of the angle between two lines times the length of the first segment, one row [px].
///
/// Lines that are parallel in images need not be so in space, nor the other way round, unless they are seen from far away.
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelLines {
    /// Two points of the line, by index among the task's features.
    pub line: [usize; 2],
    /// Two points of the other.
    pub to: [usize; 2],
    /// True where both shall point the same way, from their first points to their second ones: twice the length times the sine of half the
    /// angle.
    pub directed: bool,
}

impl ParallelLines {
    pub(super) const ROWS: usize = 1;

    pub(super) fn features(&self) -> Vec<usize> {
        [self.line, self.to].concat()
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        let along = unit(difference(&seen[2], &seen[3]));
        errors.push(turned(along, difference(&seen[0], &seen[1]), self.directed));
    }
}
