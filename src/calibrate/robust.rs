//! The end-to-end fit among wrong data: fit with a loss that lets go of outliers, judge, leave out, and again.
use super::Finding;
use super::graph::{Freedom, State};
use super::outliers::{Verdict, judge, moved_camera};
use super::readings::{self, wrong_readings};
use super::setup::Setup;
use super::stage::{Stage, Stages};
use crate::Error;
use handeye_solvers::Loss;

/// Widths of Cauchy's loss [standard deviations]: the first time, and whenever something was left out.
const WIDTHS: [f64; 2] = [20.0, 3.0];

/// Rounds of fitting and judging at most.
const ROUNDS: usize = 8;

/// Fits robustly until the verdict on images, samples and cameras no longer changes.
pub(crate) fn fit(state: &mut State, freedom: &Freedom, stages: &mut Stages<'_>) -> Result<Verdict, Error> {
    let setup = stages.setup;
    let mut verdict = Verdict::all(setup);
    let mut widths = &WIDTHS[..];
    for _ in 0..ROUNDS {
        for &width in widths {
            let takes_part = |index: usize| !verdict.left_out[index];
            let loss = Loss::Cauchy(width);
            stages.minimize(&Stage { name: "end to end, robust", freedom, loss, takes_part: &takes_part }, state)?;
        }
        widths = &WIDTHS[1..];
        let before = std::mem::take(&mut verdict.left_out);
        verdict = judge(setup, state, &before, &verdict.moved);
        let wrong: Vec<usize> =
            wrong_readings(setup, state).into_iter().filter(|&sample| state.trusted[sample]).collect();
        if verdict.left_out != before || !wrong.is_empty() {
            wrong.into_iter().for_each(|sample| state.trusted[sample] = false);
            check_rest(setup, &verdict)?;
            continue;
        }
        let Some(camera) = moved_camera(setup, state, &verdict) else { break };
        verdict.moved[camera] = true;
        verdict = judge(setup, state, &before, &verdict.moved);
    }
    verdict.findings.extend(readings::findings(setup, state));
    Ok(verdict)
}

/// Where most samples do not fit, something is wrong with all of them.
fn check_rest(setup: &Setup, verdict: &Verdict) -> Result<(), Error> {
    let wrong = verdict.findings.iter().filter(|finding| matches!(finding, Finding::WrongJoints { .. })).count();
    if 2 * wrong <= setup.len() {
        return Ok(());
    }
    let (read, check) = if setup.states.chain {
        ("joints", "the order, units and kinds of the joints")
    } else {
        ("tip poses", "that poses are those of the tip in the world, in metres, with quaternions as x, y, z, w")
    };
    Err(Error::NotEnoughData(format!(
        "the {read} of {wrong} of {} samples do not lead to what the cameras saw: check that readings and images are of the \
         same moments, and {check}",
        setup.len()
    )))
}

/// Puts cameras that moved where they were for most of the recording, with everything else held, and holds them: they say
/// nothing of anything else, and nothing is said of how well their poses are known.
pub(crate) fn place_moved(
    state: &mut State,
    freedom: &mut Freedom,
    verdict: &Verdict,
    stages: &mut Stages<'_>,
) -> Result<(), Error> {
    if !verdict.moved.contains(&true) {
        return Ok(());
    }
    let setup = stages.setup;
    let mut only = Freedom::nothing(setup);
    for (camera, _) in verdict.moved.iter().enumerate().filter(|(_, moved)| **moved) {
        only.cameras[camera] = [false; 6];
        freedom.cameras[camera] = [true; 6];
        freedom.intrinsics[camera] = [true; 12];
    }
    let takes_part = |index: usize| verdict.moved[setup.observations[index].camera];
    let loss = Loss::Cauchy(WIDTHS[1]);
    stages.minimize(&Stage { name: "cameras that moved", freedom: &only, loss, takes_part: &takes_part }, state)?;
    Ok(())
}
