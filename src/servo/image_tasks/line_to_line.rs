//! A line shall be on another.
use super::line::distance;
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "line-to-line";

/// e_ll: the signed distances of the two points of a line from another line, two rows [px]. Either end may come first.
#[derive(Clone, Debug, PartialEq)]
pub struct LineToLine {
    /// Two points of the line, by index among the task's features.
    pub line: [usize; 2],
    /// Two points of the other.
    pub to: [usize; 2],
}

impl LineToLine {
    pub(super) const ROWS: usize = 2;

    pub(super) fn features(&self) -> Vec<usize> {
        [self.line, self.to].concat()
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        errors.extend([0, 1].map(|end| distance(&seen[end], &seen[2], &seen[3])));
    }
}
