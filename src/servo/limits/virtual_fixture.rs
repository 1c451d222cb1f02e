//! A line or a plane that the tip follows.
use super::{Arm, Configuration, HalfSpace, Limit, LimitRows};
use nalgebra::Vector3;

/// Keeps the tip's origin within a tolerance of a line or a plane, along which it is free; brings it back from farther away.
///
/// Around a line the tip stays in a square inside the circle of the tolerance: 71 % of it where a side lies nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualFixture {
    /// What is followed.
    pub guide: Guide,
    /// Farthest distance from it [m].
    pub tolerance: f64,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

/// A line or a plane in the world; the lengths of directions do not matter, but where one is 0 nothing is limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Guide {
    /// Through a point [m] along a direction.
    Line(Vector3<f64>, Vector3<f64>),
    /// Through a point [m] across a normal.
    Plane(Vector3<f64>, Vector3<f64>),
}

impl Limit for VirtualFixture {
    fn rows(&self, arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows) {
        let mut within = |point: &Vector3<f64>, across: Vector3<f64>, tolerance: f64| {
            for normal in [across, -across] {
                let offset = normal.dot(point) + tolerance;
                HalfSpace { normal, offset, strength: self.strength }.rows(arm, at, dt, rows);
            }
        };
        match self.guide {
            Guide::Plane(point, normal) => {
                if let Some(normal) = normal.try_normalize(0.0) {
                    within(&point, normal, self.tolerance);
                }
            }
            Guide::Line(point, direction) => {
                if let Some(direction) = direction.try_normalize(0.0) {
                    let first = direction.cross(&Vector3::ith(direction.iamin(), 1.0)).normalize();
                    let side = self.tolerance / 2.0_f64.sqrt();
                    within(&point, first, side);
                    within(&point, direction.cross(&first), side);
                }
            }
        }
    }
}
