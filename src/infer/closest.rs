//! The joints that bring the tip closest to a pose that is out of reach.
use super::inverse::{InverseKinematics, LONGEST};
use handeye_solvers::Pose;

/// Iterations that look for the closest joints where a pose is out of reach; 5 to 20 are the rule.
const CLOSEST: usize = 100;

/// Step at which they stop [rad or m].
const ARRIVED: f64 = 1e-9;

impl InverseKinematics {
    /// Damped Newton steps, whose cost never grows: to the closest joints of a pose that may be out of reach. The cost there.
    pub(super) fn approach(&mut self, target: &Pose) -> f64 {
        let length = self.options.metres_per_radian;
        let mut cost = self.error.look(&self.chain, target, &self.joints, length);
        let mut lambda = 1e-3 * (1.0 + cost);
        for _ in 0..CLOSEST {
            let settings = (length, lambda);
            let step = self.error.newton_step(&self.chain, target, &self.limits, &self.joints, settings);
            let step = step.filter(|step| step.iter().all(|s| s.abs() <= LONGEST));
            let Some(step) = step else {
                lambda *= 10.0;
                continue;
            };
            let longest = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
            self.trial.clear();
            self.trial.extend(self.joints.iter().zip(step).map(|(joint, s)| joint + s));
            let tried = self.error.look(&self.chain, target, &self.trial, length);
            if tried <= cost {
                std::mem::swap(&mut self.joints, &mut self.trial);
                (cost, lambda) = (tried, 0.1 * lambda);
            } else {
                lambda *= 10.0;
            }
            if longest < ARRIVED || !lambda.is_finite() {
                break;
            }
        }
        cost
    }
}
