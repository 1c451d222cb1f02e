//! A point shall be where another is.
use super::line::difference;
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "point-to-point";

/// e_pp = p - q: two rows [px], along u and v.
#[derive(Clone, Debug, PartialEq)]
pub struct PointToPoint {
    /// p, by index among the task's features.
    pub point: usize,
    /// q.
    pub to: usize,
}

impl PointToPoint {
    pub(super) const ROWS: usize = 2;

    pub(super) fn features(&self) -> Vec<usize> {
        vec![self.point, self.to]
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        errors.extend(difference(&seen[1], &seen[0]));
    }
}
