//! Learns a rig from a recording.
mod anchor;
mod camera_pose;
mod cameras;
mod cures;
mod deviations;
mod direction;
mod evaluate;
mod findings;
mod finish;
mod fitting;
mod gauge;
mod graph;
mod influence;
mod initialise;
mod join;
mod kinematics;
mod known;
mod lag;
mod lengths;
mod lenses;
mod leverage;
mod look;
mod misfit;
mod motion;
mod moves;
mod numbers;
mod observation;
mod outliers;
mod overstated;
mod placed;
mod poorly;
mod priors;
mod reading_noise;
mod readings;
mod relearn;
mod report;
mod residuals;
mod robust;
mod selection;
mod settle;
mod setup;
mod sources;
mod stage;
mod states;
mod suggest;
mod targets;
mod trunk;
mod unknown;
mod unlisted;
mod variances;
mod visual;
mod weak;

pub use camera_pose::{CameraPose, camera_poses, camera_poses_in_words};
pub(crate) use cameras::with_headers;
pub use evaluate::{
    CameraErrors, Distances, Errors, Evaluation, PixelDistance, PointErrors, SampleDistances, SpaceErrors, distances,
    evaluate,
};
pub(crate) use evaluate::{Correspondence, median};
pub use findings::findings_in_words;
pub use fitting::Fitting;
pub use influence::{Influence, most_influential, worst_fitting};
pub(crate) use lag::{
    CLEARLY_BETTER, Motion, SAME as SAME_LAG, in_words as lag_in_words, interpolated, usual_distance,
};
pub use lenses::{LensNumber, lenses_against_given, lenses_in_words};
pub(crate) use misfit::over_noise;
pub(crate) use observation::Kind;
pub(crate) use outliers::{is_wrong, yardstick};
pub use overstated::{OverstatedNoise, overstated_noise};
pub(crate) use placed::Placed;
pub use priors::assumptions;
pub(crate) use priors::prior_sds;
pub use reading_noise::ReadingNoise;
pub(crate) use reading_noise::by_joint as displaced_by_joint;
pub use relearn::relearn;
pub use report::{Calibration, Distance, Finding, PoseDeviation, Report, StageReport, TipDeviation, length_in_words};
pub use selection::{NoiseTrial, select_noise};
pub use sources::Sources;
pub use suggest::{SuggestOptions, SuggestedSample, Suggestion, suggest};
pub use targets::{Disagreement, TargetReport};
pub use unlisted::{hold, put_on_tip};
pub(crate) use unlisted::{list_cameras, list_features};
pub(crate) use weak::in_words as combinations_in_words;
pub(crate) use weak::times;
pub use weak::{Combination, DeterminedBy};

use crate::Error;
use crate::recording::{Recording, Sample};
use crate::rig::{Noise, Parameter, Rig};
use deviations::{Honest, deviations, scatter};
use finish::finish;
use graph::{Freedom, Priors, State};
use handeye_solvers::Loss;
use initialise::initialise;
use setup::Setup;
use stage::{Stage, Stages};
use std::ops::ControlFlow;

/// How to calibrate.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Seed of every random choice: the same seed gives the same rig, bit for bit.
    pub seed: u64,
    /// Whether the noise of pixels, points, joints, poses and actions is estimated from the data (variance components). What the
    /// rig states is where that starts; where it says that something recorded is exact, a guess is.
    pub estimate_noise: bool,
    /// Whether the influence of every sample is computed: takes less than the calibration itself.
    pub influence: bool,
    /// Most iterations of each fit; there are several.
    pub iterations: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options { seed: 1, estimate_noise: false, influence: false, iterations: 200 }
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
    if is_of_targets(recording) {
        if !rig.estimate.lengths.is_empty() || rig.estimate.tag_side.is_some() {
            return Err(Error::Unusable(
                "`lengths` and `tag_side` of [estimate] are of features and cameras, and this is a recording of targets".to_owned(),
            ));
        }
        return targets::calibrate_targets(rig, recording, options, observer);
    }
    let mut rig = rig.clone();
    if options.estimate_noise {
        variances::guess(&mut rig.noise, recording);
    }
    let mut setup = Setup::new(&rig, recording)?;
    let (mut start, mut reports) = (None, Vec::new());
    let mut round = 0;
    loop {
        let mut attempt = attempt(&setup, start.take(), options, observer)?;
        reports.append(&mut attempt.reports);
        let settled = attempt.noise.is_none_or(|noise| variances::change(&setup.rig.noise, &noise) < SETTLED);
        if settled || round == ROUNDS {
            let Attempt { state, verdict, converged, gauge, deviations, influence, .. } = attempt;
            let mut learned = finish(&setup, &state, verdict, reports, converged && settled, gauge, deviations);
            learned.report.noise = options.estimate_noise.then_some(setup.rig.noise);
            learned.report.influence = influence;
            let lag = lag::behind(&learned.report.findings, &learned.rig, recording);
            learned.report.findings.splice(..0, lag);
            return Ok(learned);
        }
        setup.rig.noise = attempt.noise.unwrap_or(setup.rig.noise);
        start = Some(attempt.state);
        round += 1;
    }
}

/// Which of the paper's settings applies to a recording, in words: what tells of the robot's state, and how well it is known.
///
/// Fails as [`calibrate()`] does where rig and recording do not fit together.
pub fn states_in_words(rig: &Rig, recording: &Recording) -> Result<Vec<String>, Error> {
    Ok(Setup::new(rig, recording)?.states.words(&rig.noise))
}

/// Rounds of the estimation of noise at most, and the relative change below which it has settled.
const ROUNDS: usize = 30;
const SETTLED: f64 = 0.01;

/// A calibration under given noise.
struct Attempt {
    state: State,
    verdict: outliers::Verdict,
    reports: Vec<StageReport>,
    converged: bool,
    gauge: Vec<String>,
    deviations: deviations::Deviations,
    influence: Vec<Influence>,
    /// What the noise seems to be, where that is asked for.
    noise: Option<Noise>,
}

/// Calibrates from a start, or from nothing.
fn attempt(
    setup: &Setup,
    start: Option<State>,
    options: &Options,
    observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Attempt, Error> {
    let priors = Priors::new(setup);
    let mut stages = Stages::new(setup, &priors, options.iterations, observer);
    let Fitted { state, freedom, gauge, verdict, loss, converged } = fit(&mut stages, start, options.seed)?;
    let takes_part = |index: usize| verdict.active[index];
    let last = Stage { name: LAST, freedom: &freedom, loss, takes_part: &takes_part };
    let noise = if options.estimate_noise {
        Some(variances::estimate(&stages, &last, &state, &verdict).map_err(|error| {
            Error::NotEnoughData(format!("the noise cannot be estimated where the data leave the rig open: {error}"))
        })?)
    } else {
        None
    };
    let honest = Honest::new(&stages, &last, &state, &verdict);
    let deviations = deviations(&honest, &freedom, &state, &verdict);
    let influence = if options.influence { influence::influence(&stages, &last, &state, &verdict) } else { Vec::new() };
    let reports = std::mem::take(&mut stages.reports);
    Ok(Attempt { state, verdict, reports, converged, gauge, deviations, influence, noise })
}

/// Name of the last stage.
const LAST: &str = "end to end";

/// A rig that fits, and what the fit was of.
struct Fitted {
    state: State,
    freedom: Freedom,
    gauge: Vec<String>,
    verdict: outliers::Verdict,
    loss: Loss,
    converged: bool,
}

/// Fits from a start, or from nothing.
fn fit(stages: &mut Stages<'_>, start: Option<State>, seed: u64) -> Result<Fitted, Error> {
    let setup = stages.setup;
    let mut state = match start {
        Some(state) => state,
        None if is_complete(setup) => State::new(setup),
        None => initialise(seed, stages)?,
    };
    unknown::place_unknown(&mut state, stages);
    let (mut freedom, gauge) = gauge::end_to_end(setup, &mut state, stages.priors);
    let verdict = robust::fit(&mut state, &freedom, stages)?;
    robust::place_moved(&mut state, &mut freedom, &verdict, stages)?;
    let takes_part = |index: usize| verdict.active[index];
    // Where the images are noisier than stated, the tails begin later.
    let loss = Loss::Cauchy(TAILS * scatter(setup, &state, &verdict).max(1.0));
    let last = Stage { name: LAST, freedom: &freedom, loss, takes_part: &takes_part };
    let converged = stages.minimize(&last, &mut state)?.termination.converged();
    check_cameras(setup, &state)?;
    Ok(Fitted { state, freedom, gauge, verdict, loss, converged })
}

/// True where targets are what there is to learn from. Where joints and pixels were recorded too, pixels say more.
fn is_of_targets(recording: &Recording) -> bool {
    let has_detections = |sample: &Sample| !sample.pixels.is_empty() || !sample.points.is_empty();
    let seen = |sample: &Sample| has_detections(sample) && sample.joints.is_some();
    recording.samples.iter().any(|sample| !sample.targets.is_empty()) && !recording.samples.iter().any(seen)
}

/// A camera that projects backwards or not at all was not learned.
fn check_cameras(setup: &Setup, state: &State) -> Result<(), Error> {
    let lenses = setup.rig.cameras.iter().zip(&state.model.cameras).filter(|(_, learned)| learned.has_lens());
    for (camera, learned) in lenses {
        let [fx, fy, ..] = learned.intrinsics;
        if !(fx > 0.0 && fy > 0.0 && learned.intrinsics.iter().all(|value| value.is_finite())) {
            return Err(Error::NotEnoughData(format!(
                "the data do not determine camera `{}`: its focal lengths went to {fx:.1} and {fy:.1} px; give its intrinsics",
                camera.name
            )));
        }
    }
    Ok(())
}

/// Width of Cauchy's loss in the last stage [standard deviations]. Real errors have heavier tails than a Gaussian; on Gaussian
/// ones this width costs under one percent of the information.
const TAILS: f64 = 5.0;

/// True where everything is given, so that nothing needs to be initialised.
fn is_complete(setup: &Setup) -> bool {
    let rig = &setup.rig;
    setup.chain_is_known()
        && (rig.robot.base.is_some() || !gauge::world_is_known(setup) || rig.is_fixed(&Parameter::Base))
        && rig.cameras.iter().all(|camera| camera.pose.is_some())
        && rig.features.iter().all(|feature| feature.xyz.is_some())
}
