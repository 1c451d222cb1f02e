//! An axis of the tip towards a point that is fixed in space.
use super::{Arm, Configuration, Task, TaskRows};
use nalgebra::Vector3;

/// Turns an axis of the tip towards a point of the world: z = d, with z the axis and d the direction from the tip to the point, both of
/// unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// The point in the world [m].
    pub point: Vector3<f64>,
    /// The axis in the tip's frame; its length does not matter.
    pub axis: Vector3<f64>,
    /// Standard deviation of the angle about each axis [rad].
    pub sd: f64,
}

/// Nearer than this the direction to the point is any [m].
const NEAREST: f64 = 1e-6;

impl Task for LookAt {
    fn rows(&self, _arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        let tip = at.posture.tip();
        let from_tip = self.point - tip.translation;
        let distance = from_tip.norm();
        let Some(axis) = (tip.rotation * self.axis).try_normalize(0.0) else { return };
        if distance.is_nan() || distance <= NEAREST {
            return;
        }
        let direction = from_tip / distance;
        let wanted = direction - axis;
        for k in 0..3 {
            let slopes = at.posture.axes.iter().map(|joint| {
                let (w, v) = joint.twist(&tip.translation);
                // The axis turns with the tip; the line of sight turns as the tip moves across it.
                let across = v - direction * direction.dot(&v);
                (w.cross(&axis) + across / distance)[k]
            });
            rows.push(slopes, wanted[k], self.sd);
        }
    }
}
