//! The tip on one side of a plane.
use super::{Arm, Configuration, Limit, LimitRows, SHARE};
use nalgebra::Vector3;

/// Keeps the tip's origin on one side of a plane, normal·p ≤ offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal in the world, pointing out of where the tip may be.
    pub normal: Vector3<f64>,
    /// Distance of the plane from the world's origin along the normal [m].
    pub offset: f64,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

impl Limit for HalfSpace {
    fn rows(&self, _arm: &Arm, at: &Configuration, _dt: f64, rows: &mut LimitRows) {
        let tip = at.posture.tip().translation;
        let slopes = at.posture.axes.iter().map(|axis| self.normal.dot(&axis.twist(&tip).1));
        rows.push(slopes, SHARE * (self.offset - self.normal.dot(&tip)), self.strength);
    }
}
