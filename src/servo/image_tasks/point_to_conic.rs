//! A point shall be on a conic.
use super::conic::Conic;
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "point-to-conic";

/// e_pc: the distance of a point from the conic through five points or more, one row [px], positive outside of an ellipse.
#[derive(Clone, Debug, PartialEq)]
pub struct PointToConic {
    /// The point, by index among the task's features.
    pub point: usize,
    /// Points of the conic, such as of the rim of a hole.
    pub conic: Vec<usize>,
}

impl PointToConic {
    pub(super) const ROWS: usize = 1;

    pub(super) fn features(&self) -> Vec<usize> {
        [&[self.point], self.conic.as_slice()].concat()
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        errors.push(Conic::through(&seen[1..]).distance(&seen[0]));
    }
}
