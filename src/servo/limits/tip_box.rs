//! The tip in a box.
use super::{Arm, Configuration, HalfSpace, Limit, LimitRows};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Keeps the tip's origin inside a box that lies anyhow in the world: low ≤ p ≤ high for each coordinate of the box's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipBox {
    /// `world_from_box`.
    pub frame: Pose,
    /// Smallest coordinates in the box's frame [m]; -∞ where there is no face.
    pub low: Vector3<f64>,
    /// Largest coordinates [m]; ∞ where there is no face.
    pub high: Vector3<f64>,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

impl Limit for TipBox {
    fn rows(&self, arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows) {
        for k in 0..3 {
            let axis = self.frame.rotation.column(k).into_owned();
            let origin = axis.dot(&self.frame.translation);
            for (normal, offset) in [(axis, origin + self.high[k]), (-axis, -origin - self.low[k])] {
                if offset.is_finite() {
                    HalfSpace { normal, offset, strength: self.strength }.rows(arm, at, dt, rows);
                }
            }
        }
    }
}
