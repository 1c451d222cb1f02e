//! Whether the translations of targets have a scale of their own, as monocular ones do.
use super::graph::{State, build};
use super::{Fitted, TAILS};
use crate::Error;
use handeye_solvers::{Covariance, Loss, Solver};

/// A scale counts as unknown where it is this far from 1, by so many standard deviations.
const OFF_SCALE: f64 = 0.03;
const SURE: f64 = 5.0;

/// Of what errors tell of their size, medians, from which the noise is estimated, use this share.
const EFFICIENCY: f64 = 0.37;

impl Fitted {
    /// True where a free scale explains far more than the scale 1, under the noise that it leaves, and is known well enough to say so.
    pub(super) fn is_better_than(&self, fixed: &Fitted) -> Result<bool, Error> {
        let scale = self.state.scale;
        if (scale - 1.0).abs() < OFF_SCALE {
            return Ok(false);
        }
        let Ok(mut covariance) = Covariance::with(&self.built.graph, Solver::new(&self.built.graph)) else {
            return Ok(false);
        };
        let sd = covariance.of(self.built.scale)[(0, 0)].max(0.0).sqrt() / scale;
        if scale.ln().abs() < SURE * sd {
            return Ok(false);
        }
        let mut state = State { sigmas: self.state.sigmas, walks: self.state.walks, ..fixed.state.clone() };
        let mut built = build(&fixed.setup, &state, fixed.freedom, Loss::Cauchy(TAILS));
        let (report, _) = built.minimize(&mut state)?;
        Ok(self.with_known_noise(2.0 * (report.final_cost - self.report.final_cost)) > SURE * SURE)
    }

    /// What one more unknown explains, t² where the noise was estimated from the errors that are left, as the χ² of known noise that is as
    /// unlikely (Wallace 1959).
    fn with_known_noise(&self, explained: f64) -> f64 {
        let setup = &self.setup;
        if setup.rig.noise.target.is_some() || setup.views.iter().all(|view| view.whitening.is_some()) {
            return explained;
        }
        let numbers = 6.0 * setup.views.len() as f64;
        let unknowns = 6 * (setup.rig.cameras.len() + setup.rig.targets.len()) + 1 + usize::from(self.freedom.offset);
        let left = numbers - unknowns as f64;
        if left <= 0.0 {
            return 0.0;
        }
        let freedom = EFFICIENCY * left;
        let correction = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
        correction * correction * freedom * (explained * left / numbers / freedom).ln_1p()
    }
}
