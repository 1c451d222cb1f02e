//! A point shall be where another is in space, as a depth camera or a triangulation has both.
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "point-to-point-3d";

/// s (p - q): three rows, along the axes of the camera's frame, in metres times s, which are pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct PointToPoint3d {
    /// p, by index among the task's features.
    pub point: usize,
    /// q.
    pub to: usize,
    /// s: what a metre counts as [px/m]. A camera's focal length over the distance makes both kinds of errors alike.
    pub px_per_metre: f64,
}

impl PointToPoint3d {
    pub(super) const ROWS: usize = 3;

    pub(super) fn features(&self) -> Vec<usize> {
        vec![self.point, self.to]
    }

    pub(super) fn errors<T: Scalar>(&self, seen: &[Vector3<T>], errors: &mut Vec<T>) {
        errors.extend((0..3).map(|i| (seen[0][i] - seen[1][i]) * self.px_per_metre));
    }
}
