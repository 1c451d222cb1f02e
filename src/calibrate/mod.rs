//! Learns a rig from a recording.
mod anchor;
pub(crate) mod evaluate;
mod finish;
mod gauge;
mod graph;
mod initialise;
mod join;
mod kinematics;
mod outliers;
mod priors;
mod report;
mod setup;
mod stage;
mod visual;

pub use evaluate::{CameraErrors, Errors, Evaluation, evaluate};
pub use report::{Calibration, Finding, Report, StageReport, TipDeviation};

use crate::Error;
use crate::recording::Recording;
use crate::rig::Rig;
use graph::{Priors, State};
use handeye_solvers::{Loss, Pose};
use outliers::Verdict;
use setup::Setup;
use stage::Stages;
use std::ops::ControlFlow;

/// How to calibrate.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Seed of every random choice: the same seed gives the same rig, bit for bit.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Options { seed: 1 }
    }
}

/// What a calibration is doing, for progress bars; breaking off cancels it.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress<'a> {
    /// Name of the stage.
    pub stage: &'a str,
    /// Iterations or trials done in it.
    pub done: usize,
    /// Of how many at most.
    pub of: usize,
    /// Root mean square pixel distance where there is one [px].
    pub rms_px: Option<f64>,
}

/// Called as a calibration goes on.
pub type Observer<'a> = &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>;

/// Learns what is unknown of a rig from a recording, and refines the rest.
///
/// Fails with [`Error::NotEnoughData`] where the recording cannot determine the rig, naming what is missing, and with
/// [`Error::Unusable`] where rig and recording do not fit together.
pub fn calibrate(
    rig: &Rig,
    recording: &Recording,
    options: &Options,
    observer: Observer<'_>,
) -> Result<Calibration, Error> {
    let setup = Setup::new(rig, recording)?;
    let priors = Priors::new(&setup);
    let mut stages = Stages { reports: Vec::new(), observer, cancelled: false };
    let mut state = if is_complete(&setup) {
        let tips = vec![Pose::identity(); setup.joints.len()];
        State { model: setup.model.clone(), tips }
    } else {
        initialise::initialise(&setup, &priors, options.seed, &mut stages)?
    };
    let (freedom, gauge) = gauge::end_to_end(&setup, &mut state, &priors);
    let mut verdict = Verdict { active: vec![true; setup.observations.len()], ..Verdict::default() };
    let mut left_out = vec![false; setup.observations.len()];
    for width in ROBUST {
        let part = |index: usize| !left_out[index];
        stages.minimize("end to end, robust", &setup, &mut state, &freedom, &priors, Loss::Cauchy(width), part)?;
        verdict = outliers::judge(&setup, &state, &left_out);
        // What single detections do is left to the loss until the end; images and samples that are wrong go at once.
        left_out = setup.observations.iter().map(|seen| verdict.moved[seen.camera]).collect();
    }
    let report = stages
        .minimize("end to end", &setup, &mut state, &freedom, &priors, Loss::Squared, |index| verdict.active[index])?;
    let converged = report.termination.converged();
    let deviations = finish::Deviations::default();
    Ok(finish::finish(&setup, &state, verdict, stages.reports, converged, gauge, deviations))
}

/// Widths of Cauchy's loss in the robust end-to-end stages [standard deviations].
const ROBUST: [f64; 3] = [20.0, 3.0, 3.0];

/// True where everything is given, so that nothing needs to be initialised.
fn is_complete(setup: &Setup) -> bool {
    let rig = &setup.rig;
    setup.chain_is_known()
        && rig.cameras.iter().all(|camera| camera.pose.is_some())
        && rig.features.iter().all(|feature| feature.xyz.is_some())
}
