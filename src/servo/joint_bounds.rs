//! Position, velocity and acceleration of the joints, merged into one box of motions.
use crate::rig::Limits;

/// What bounds the motion of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bound {
    /// Nothing.
    #[default]
    None,
    /// Its range.
    Position,
    /// Its speed.
    Velocity,
    /// How fast its speed may change, or that it must be able to stop before the end of its range.
    Acceleration,
}

/// A box of motions [rad or m] that never is empty, and what made each side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointBounds {
    /// Least motion of every joint.
    pub lower: Vec<f64>,
    /// Largest motion of every joint.
    pub upper: Vec<f64>,
    /// What made `lower`.
    pub of_lower: Vec<Bound>,
    /// What made `upper`.
    pub of_upper: Vec<Bound>,
}

impl JointBounds {
    /// Of the next `dt` seconds, for joints at readings and velocities [rad and rad/s, or m and m/s], one each. The range is hard: from outside, the motion may only lead back. Speed comes before acceleration, and
    /// the range before both, where they cannot all hold.
    pub fn update(&mut self, limits: &[Limits], joints: &[f64], velocity: &[f64], dt: f64) {
        self.lower.clear();
        self.upper.clear();
        self.of_lower.clear();
        self.of_upper.clear();
        for ((limits, joint), &speed) in limits.iter().zip(joints).zip(velocity) {
            let room_up = limits.upper.map_or(f64::INFINITY, |upper| upper - joint);
            let room_down = limits.lower.map_or(f64::INFINITY, |lower| joint - lower);
            let fastest = limits.velocity.unwrap_or(f64::INFINITY) * dt;
            let change = limits.acceleration.map(|acceleration| (acceleration, speed));
            let (up, of_upper) = farthest(room_up, fastest, change, dt);
            let (down, of_lower) = farthest(room_down, fastest, change.map(|(a, v)| (a, -v)), dt);
            // From outside, the motion leads back or stands still.
            let (mut lower, mut upper) = (-down, up);
            if lower > upper {
                // Still too fast to stop in time: brake as hard as the range asks for.
                let inside = |motion: f64| motion.clamp(-room_down.max(0.0), room_up.max(0.0));
                let braked = inside(if speed > 0.0 { upper } else { lower });
                (lower, upper) = (braked, braked);
            }
            self.lower.push(lower);
            self.upper.push(upper);
            self.of_lower.push(of_lower);
            self.of_upper.push(of_upper);
        }
    }
}

/// How far a joint may move in one direction, and why no farther. `room`: to the end of its range; `change`: acceleration and speed
/// in that direction.
fn farthest(room: f64, fastest: f64, change: Option<(f64, f64)>, dt: f64) -> (f64, Bound) {
    let room = room.max(0.0);
    let mut best = (room, if room.is_finite() { Bound::Position } else { Bound::None });
    if fastest < best.0 {
        best = (fastest, Bound::Velocity);
    }
    if let Some((acceleration, speed)) = change {
        // Reached from the present speed; and slow enough to stop within what is left after the step:
        // d + d² / (2 a dt²) ≤ room.
        let reached = (speed + acceleration * dt) * dt;
        let step = acceleration * dt * dt;
        let stopping = if room.is_finite() { step * ((1.0 + 2.0 * room / step).sqrt() - 1.0) } else { f64::INFINITY };
        let least = reached.min(stopping);
        if least < best.0 {
            best = (least, Bound::Acceleration);
        }
    }
    best
}
