//! Points on two links apart.
use super::{Arm, Configuration, Limit, LimitRows, SHARE};
use nalgebra::Vector3;

/// Keeps a point on one link away from a point on another, or on the base: spheres that must not touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkDistance {
    /// Number of joints before each link: 0 is the base, which stands still, as many as there are joints the tip; one beyond the tip
    /// limits nothing.
    pub links: [usize; 2],
    /// The points, each in the frame of its link [m].
    pub points: [Vector3<f64>; 2],
    /// Least distance [m].
    pub distance: f64,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

impl Limit for LinkDistance {
    fn rows(&self, _arm: &Arm, at: &Configuration, _dt: f64, rows: &mut LimitRows) {
        let place = |k: usize| at.posture.links.get(self.links[k]).map(|link| link.transform(&self.points[k]));
        let (Some(first), Some(second)) = (place(0), place(1)) else { return };
        let between = first - second;
        let distance = between.norm();
        // Two points in one place may part in any direction.
        let apart = between.try_normalize(1e-9).unwrap_or_else(Vector3::z);
        let nearing = at.posture.axes.iter().enumerate().map(|(i, axis)| {
            let velocity = |link: usize, point| if i < link { apart.dot(&axis.twist(point).1) } else { 0.0 };
            velocity(self.links[1], &second) - velocity(self.links[0], &first)
        });
        rows.push(nearing, SHARE * (distance - self.distance), self.strength);
    }
}
