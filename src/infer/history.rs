//! Branches told apart by the actions taken: what was inferred before, moved by an action, against what is seen after.
use super::branch::{APART, Branch, Minimum, branches};
use super::information::Information;
use super::joints::Inference;
use super::pose::is_plausible;
use super::prior::Prior;
use super::{Sighting, Sightings};
use crate::Error;
use nalgebra::DMatrix;

/// A moment of a history.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// What was seen.
    pub sightings: Vec<Sighting>,
    /// Commanded motion from this moment to the next, one number per joint [rad or m]; `None` where it is unknown.
    pub action: Option<Vec<f64>>,
}

/// Least standard deviation of a motion [rad or m]: so far a rig that claims exact actions is trusted.
const EXACT: f64 = 1e-4;

impl Inference {
    /// The joints' branches at the last moment of a history, most probable first.
    ///
    /// An action that is unknown loses what was inferred before it, and so does a moment that no branch explains. `prior`: of the first
    /// moment. Errors: as [`Inference::joints`], of the last moment.
    pub fn joints_of_history(&mut self, history: &[Moment], prior: &Prior) -> Result<Vec<Branch>, Error> {
        let mut belief: Result<Vec<Branch>, Error> = Err(Error::NotEnoughData("the history is empty".to_owned()));
        let mut action: Option<&[f64]> = None;
        let nothing = Prior::none();
        for (index, moment) in history.iter().enumerate() {
            belief = match (&belief, action) {
                (Ok(before), Some(action)) => self.joints_after(before, action, &moment.sightings),
                _ => self.joints(&moment.sightings, if index == 0 { prior } else { &nothing }),
            };
            action = moment.action.as_deref();
        }
        belief
    }

    /// The branches after an action: those of before, moved by it, weighed by what is seen now; most probable first.
    ///
    /// Actions count with the rig's `noise.joint_action`. Where none of them explains what is seen, joints are inferred anew, as by
    /// [`Inference::joints`]. `action`: one number per joint [rad or m].
    ///
    /// Errors: [`Error::Unusable`] for an action or branches that are not of this rig.
    pub fn joints_after<'a>(
        &mut self,
        before: &[Branch],
        action: &[f64],
        sightings: impl Into<Sightings<'a>>,
    ) -> Result<Vec<Branch>, Error> {
        let (n, sightings) = (self.chain.len(), sightings.into());
        let fits = |branch: &Branch| branch.joints.len() == n && branch.covariance.shape() == (n, n);
        if action.len() != n || !action.iter().all(|number| number.is_finite()) || !before.iter().all(fits) {
            let found = action.len();
            return Err(Error::Unusable(format!("an action of {found} finite numbers; the rig has {n} joints")));
        }
        let seen = self.moved(sightings);
        let limits = Prior::none().information(&self.limits);
        let mut minima: Vec<Minimum> = Vec::new();
        for branch in before {
            let Some((information, weight)) = self.moved_belief(branch, action) else { continue };
            let Some(minimum) = self.refine_belief(&seen, &information, &limits, weight) else { continue };
            match minima.iter_mut().find(|other| self.limits.distance(&other.joints, &minimum.joints) < APART) {
                Some(other) => other.merge(&minimum),
                None => minima.push(minimum),
            }
        }
        // Among them, what is less probable by far does not have to explain what is seen.
        let explained = minima.iter().any(|minimum| is_plausible(minimum.misfit, seen.coordinates()));
        if !explained && !seen.is_empty() {
            return self.joints(sightings, &Prior::none());
        }
        Ok(branches(minima, &seen))
    }

    /// Mean and precision of a branch after an action, and -ln of its probability density there.
    fn moved_belief(&self, branch: &Branch, action: &[f64]) -> Option<(Information, f64)> {
        let n = action.len();
        let sd = self.action_sd.max(EXACT);
        let spread = &branch.covariance + DMatrix::from_diagonal_element(n, n, sd * sd);
        let factor = spread.cholesky()?;
        let precision = factor.inverse();
        let mut mean: Vec<f64> = branch.joints.iter().zip(action).map(|(joint, step)| joint + step).collect();
        let unmoved = mean.clone();
        self.limits.bring_inside(&mut mean, &unmoved);
        let volume: f64 = factor.l_dirty().diagonal().iter().map(|pivot| pivot.ln()).sum();
        // Symmetric, so that rows are columns.
        let information = Information { mean, matrix: precision.as_slice().to_vec(), weak: vec![0.0; n] };
        Some((information, volume - branch.probability.max(f64::MIN_POSITIVE).ln()))
    }
}
