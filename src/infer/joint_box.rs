//! Where the joints may be: their limits, and turns that come round again.
use crate::chain::JointKind;
use crate::rig::Rig;
use std::f64::consts::{PI, TAU};

/// Limits of the joints. A revolute joint that can turn all the way round, or has no limits, is not bounded while a solution is
/// searched: any angle has an equal one inside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointBox {
    /// Limits as the rig has them [rad or m]; infinite where there is none.
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    /// True where the joint comes round again.
    pub turns: Vec<bool>,
}

/// Half the range that starts of a sliding joint without limits are drawn from [m].
const SLIDE: f64 = 1.0;

impl JointBox {
    pub fn new(rig: &Rig) -> Self {
        let joints = &rig.robot.joints;
        let lower: Vec<f64> = joints.iter().map(|joint| joint.limits.lower.unwrap_or(f64::NEG_INFINITY)).collect();
        let upper: Vec<f64> = joints.iter().map(|joint| joint.limits.upper.unwrap_or(f64::INFINITY)).collect();
        let comes_round = |(i, joint): (usize, &crate::rig::Joint)| {
            // Limits that were rounded to ten digits still make a whole turn.
            joint.kind == JointKind::Revolute && upper[i] - lower[i] >= TAU - 1e-9
        };
        let turns = joints.iter().enumerate().map(comes_round).collect();
        JointBox { lower, upper, turns }
    }

    pub fn len(&self) -> usize {
        self.lower.len()
    }

    /// How far a joint may move down and up from a reading inside its limits.
    #[inline]
    pub fn room(&self, joint: usize, reading: f64) -> (f64, f64) {
        if self.turns[joint] {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            ((self.lower[joint] - reading).min(0.0), (self.upper[joint] - reading).max(0.0))
        }
    }

    /// The nearest readings inside the limits, of those that turn the equal one nearest to `near`.
    pub fn bring_inside(&self, joints: &mut [f64], near: &[f64]) {
        for (i, reading) in joints.iter_mut().enumerate() {
            if self.turns[i] {
                *reading = near[i] + wrap(*reading - near[i]);
                if *reading > self.upper[i] {
                    *reading -= TAU * ((*reading - self.upper[i]) / TAU).ceil();
                }
                if *reading < self.lower[i] {
                    *reading += TAU * ((self.lower[i] - *reading) / TAU).ceil();
                }
            }
            *reading = reading.clamp(self.lower[i], self.upper[i].max(self.lower[i]));
        }
    }

    /// Where starts are drawn from: limits, and stand-ins for what has none.
    pub fn range(&self, joint: usize) -> (f64, f64) {
        if self.turns[joint] {
            return (-PI, PI);
        }
        match (self.lower[joint].is_finite(), self.upper[joint].is_finite()) {
            (true, true) => (self.lower[joint], self.upper[joint]),
            (true, false) => (self.lower[joint], self.lower[joint] + 2.0 * SLIDE),
            (false, true) => (self.upper[joint] - 2.0 * SLIDE, self.upper[joint]),
            (false, false) => (-SLIDE, SLIDE),
        }
    }

    /// Largest difference of two readings, whole turns apart being none where they come round [rad or m].
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let difference = |i: usize| if self.turns[i] { wrap(a[i] - b[i]) } else { a[i] - b[i] };
        (0..self.len()).map(|i| difference(i).abs()).fold(0.0, f64::max)
    }
}

/// The equal angle in [-π, π].
pub(crate) fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}
