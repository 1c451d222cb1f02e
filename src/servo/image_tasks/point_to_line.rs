//! A point shall be on a line.
use super::line::distance;
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "point-to-line";

/// e_pl: the signed distance of a point from the line through two others, one row [px].
#[derive(Clone, Debug, PartialEq)]
pub struct PointToLine {
    /// The point, by index among the task's features.
    pub point: usize,
    /// Two points of the line.
    pub line: [usize; 2],
}

impl PointToLine {
    pub(super) const ROWS: usize = 1;

    pub(super) fn features(&self) -> Vec<usize> {
        vec![self.point, self.line[0], self.line[1]]
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        errors.push(distance(&seen[0], &seen[1], &seen[2]));
    }
}
