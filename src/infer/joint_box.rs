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
    /// Where the joints were while the rig was learned; empty where nobody knows.
    learned: Vec<[f64; 2]>,
}

/// Least standard deviation of a joint outside the range in which the rig was learned [rad or m].
const NARROW: f64 = 0.05;

/// Half the range that starts of a sliding joint without limits are drawn from [m].
const SLIDE: f64 = 1.0;

impl JointBox {
    pub fn new(rig: &Rig) -> Self {
        let joints = &rig.robot.joints;
        let known = |limit: Option<f64>| limit.filter(|limit| !limit.is_nan());
        let lower: Vec<f64> =
            joints.iter().map(|joint| known(joint.limits.lower).unwrap_or(f64::NEG_INFINITY)).collect();
        let upper: Vec<f64> = joints.iter().map(|joint| known(joint.limits.upper).unwrap_or(f64::INFINITY)).collect();
        let comes_round = |(i, joint): (usize, &crate::rig::Joint)| {
            // Limits that were rounded to ten digits still make a whole turn.
            joint.kind == JointKind::Revolute && upper[i] - lower[i] >= TAU - 1e-9
        };
        let turns = joints.iter().enumerate().map(comes_round).collect();
        let learned = rig.fit.as_ref().map_or_else(Vec::new, |fit| fit.joints.clone());
        JointBox { lower, upper, turns, learned }
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

    /// How far every joint may move down and up from its reading.
    pub fn rooms(&self, joints: &[f64], lower: &mut Vec<f64>, upper: &mut Vec<f64>) {
        lower.clear();
        upper.clear();
        for (joint, &reading) in joints.iter().enumerate() {
            let (down, up) = self.room(joint, reading);
            lower.push(down);
            upper.push(up);
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

    /// Where a joint is expected while nothing else is known: in the middle of where it was, or may be.
    pub fn middle(&self, joint: usize) -> f64 {
        let (lower, upper) = self.learned.get(joint).map_or_else(|| self.range(joint), |range| (range[0], range[1]));
        0.5 * (lower + upper)
    }

    /// -ln of how probable it is to find a joint so far out of where it was while the rig was learned: even inside, Gaussian outside
    /// with a quarter of the range for its standard deviation. A rig learned from nothing has no limits, and its arm a branch in
    /// which it moved.
    pub fn strangeness(&self, joint: usize, reading: f64) -> f64 {
        let Some(&[lower, upper]) = self.learned.get(joint) else { return 0.0 };
        let (half, middle) = (0.5 * (upper - lower), 0.5 * (lower + upper));
        let off = if self.turns[joint] { wrap(reading - middle) } else { reading - middle };
        let outside = (off.abs() - half).max(0.0);
        0.5 * (outside / (0.5 * half).max(NARROW)).powi(2)
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
