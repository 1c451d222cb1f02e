//! How far a chain's given values are off, from the data (empirical Bayes).
use super::graph::{Built, State};
use super::setup::Setup;
use crate::chain::LINK_PARAMETERS;
use crate::rig::{JointField, Parameter};
use handeye_solvers::Covariance;

/// What an arm is taken to be off at first [rad, m]: from above, few rounds come near what the data say.
pub(super) const START: [f64; 2] = [5e-4, 3e-4];

/// What an arm is off before anything is estimated [rad, m], and how many parameters that is worth against those of the rig.
const FIRST: [f64; 2] = [1e-4, 6e-5];
const WORTH: f64 = 1.0;

/// One step of MacKay's fixed point for the standard deviations of angles and of lengths around the given values:
///
///   σ² = Σ (θ - θ₀)² / Σ (1 - var θ / σ²)
///
/// The denominator counts the parameters that the data determine. Values with a prior of their own, and held ones, do not take
/// part.
pub(super) fn estimate(setup: &Setup, built: &Built, covariance: &mut Covariance<'_>, state: &mut State) {
    let Some((key, given)) = built.parameters.zip(super::chain_of(&setup.rig)) else { return };
    let covariance = covariance.of(key);
    let (mut squares, mut determined) = ([0.0; 2], [0.0; 2]);
    for (joint, row) in setup.rig.robot.joints.iter().enumerate() {
        for (k, &field) in JointField::ALL.iter().enumerate() {
            let parameter = Parameter::JointField { joint, field };
            let absent = field == JointField::Beta && row.beta.is_none();
            if absent || setup.rig.is_fixed(&parameter) || setup.rig.prior_sd(&parameter).is_some() {
                continue;
            }
            let kind = usize::from(matches!(field, JointField::D | JointField::A));
            let at = LINK_PARAMETERS * joint + k;
            squares[kind] += (state.parameters[at] - given.parameters[at]).powi(2);
            determined[kind] += (1.0 - covariance[(at, at)] / state.spread[kind].powi(2)).clamp(0.0, 1.0);
        }
    }
    for (kind, first) in FIRST.iter().enumerate() {
        state.spread[kind] = ((squares[kind] + WORTH * first * first) / (determined[kind] + WORTH)).sqrt();
    }
}
