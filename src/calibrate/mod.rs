//! Learns a rig from a recording.
mod anchor;
mod deviations;
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
mod robust;
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
    let (mut freedom, gauge) = gauge::end_to_end(&setup, &mut state, &priors);
    let mut verdict = Verdict::all(&setup);
    robust::fit(&setup, &mut state, &freedom, &priors, &mut stages, &mut verdict)?;
    let report =
        stages.minimize("end to end", &setup, &mut state, &freedom, &priors, Loss::Cauchy(TAILS), |index| {
            verdict.active[index]
        })?;
    robust::hold_moved(&mut freedom, &verdict);
    robust::place_moved(&setup, &mut state, &freedom, &priors, &mut stages, &verdict)?;
    let converged = report.termination.converged();
    let unseen = setup.unseen.iter().map(|camera| Finding::UnseenCamera { camera: camera.clone() });
    verdict.findings.splice(0..0, unseen);
    let built = graph::build(&setup, &state, &freedom, &priors, Loss::Cauchy(TAILS), |index| verdict.active[index]);
    let deviations = deviations::deviations(&setup, &state, &freedom, &verdict, &built);
    Ok(finish::finish(&setup, &state, verdict, stages.reports, converged, gauge, deviations))
}

/// Width of Cauchy's loss in the last stage [standard deviations]. Real errors have heavier tails than a Gaussian; on Gaussian
/// ones this width costs under one percent of the information.
const TAILS: f64 = 5.0;

/// True where everything is given, so that nothing needs to be initialised.
fn is_complete(setup: &Setup) -> bool {
    let rig = &setup.rig;
    setup.chain_is_known()
        && rig.cameras.iter().all(|camera| camera.pose.is_some())
        && rig.features.iter().all(|feature| feature.xyz.is_some())
}
