//! The end-to-end fit among wrong data: fit with a loss that lets go of outliers, judge, leave out, and again.
use super::graph::{Freedom, Priors, State};
use super::outliers::{Verdict, judge, moved_camera};
use super::setup::Setup;
use super::stage::Stages;
use crate::Error;
use handeye_solvers::Loss;

/// Widths of Cauchy's loss [standard deviations]: the first time, and whenever something was left out.
const WIDTHS: [f64; 2] = [20.0, 3.0];

/// Rounds of fitting and judging at most.
const ROUNDS: usize = 8;

/// Fits robustly until the verdict on images, samples and cameras no longer changes.
pub(crate) fn fit(
    setup: &Setup,
    state: &mut State,
    freedom: &Freedom,
    priors: &Priors,
    stages: &mut Stages<'_>,
    verdict: &mut Verdict,
) -> Result<(), Error> {
    let mut widths = &WIDTHS[..];
    for _ in 0..ROUNDS {
        for &width in widths {
            let takes_part = |index: usize| !verdict.left_out[index];
            stages.minimize("end to end, robust", setup, state, freedom, priors, Loss::Cauchy(width), takes_part)?;
        }
        widths = &WIDTHS[1..];
        let before = std::mem::take(&mut verdict.left_out);
        *verdict = judge(setup, state, &before, &verdict.moved);
        if verdict.left_out != before {
            continue;
        }
        let Some(camera) = moved_camera(setup, state, verdict) else { break };
        verdict.moved[camera] = true;
        *verdict = judge(setup, state, &before, &verdict.moved);
    }
    Ok(())
}

/// Cameras that moved say nothing of anything else, and nothing is said of how well their poses are known.
pub(crate) fn hold_moved(freedom: &mut Freedom, verdict: &Verdict) {
    for (camera, _) in verdict.moved.iter().enumerate().filter(|(_, moved)| **moved) {
        freedom.cameras[camera] = [true; 6];
        freedom.intrinsics[camera] = [true; 12];
    }
}

/// Puts cameras that moved where they were for most of the recording, with everything else held.
pub(crate) fn place_moved(
    setup: &Setup,
    state: &mut State,
    freedom: &Freedom,
    priors: &Priors,
    stages: &mut Stages<'_>,
    verdict: &Verdict,
) -> Result<(), Error> {
    if !verdict.moved.contains(&true) {
        return Ok(());
    }
    let mut only = freedom.clone();
    only.base = [true; 6];
    only.parameters.fill(true);
    only.intrinsics.fill([true; 12]);
    only.features.fill([true; 3]);
    for (held, moved) in only.cameras.iter_mut().zip(&verdict.moved) {
        *held = [!moved; 6];
    }
    let takes_part = |index: usize| verdict.moved[setup.observations[index].camera];
    stages.minimize("cameras that moved", setup, state, &only, priors, Loss::Cauchy(WIDTHS[1]), takes_part)?;
    Ok(())
}
