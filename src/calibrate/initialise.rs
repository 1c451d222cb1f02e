//! From a recording to a first state of everything, without starting values (stages 1 to 3).
use super::anchor::Anchor;
use super::evaluate::median;
use super::graph::State;
use super::kinematics::{find_axes, find_lines, rows};
use super::known::known_parts;
use super::look::look;
use super::motion::from_motion;
use super::residuals::whitened;
use super::settle::settle;
use super::setup::Setup;
use super::stage::{Stage, Stages};
use super::{gauge, join};
use crate::Error;
use handeye_solvers::{Loss, Pose};

/// About how far the rotation of a seen tip is off [rad].
const GOOD_ANGLE: f64 = 0.02;

/// A first state explains the recording where its usual error is below this many standard deviations; where none does and
/// the chain's tips are further from the seen ones than this, joints and images have nothing to do with each other [rad].
const EXPLAINED: f64 = 4.0;
const UNRELATED: f64 = 0.3;

/// Width of Cauchy's loss while explanations are compared [standard deviations].
const WIDTH: f64 = 20.0;

/// Finds a first state.
///
/// Where images have several explanations, the pixels that the chain predicts decide: tips that were misplaced move as no
/// chain does.
pub(crate) fn initialise(seed: u64, stages: &mut Stages<'_>) -> Result<State, Error> {
    let setup = stages.setup;
    if let Some((state, cameras, features)) = known_parts(setup)
        && let Ok(first) = complete(state, 0.0, &cameras, &features, seed, stages)
        && first.error < EXPLAINED
    {
        return Ok(first.state);
    }
    let (explanations, mut failure) = match look(seed, stages) {
        Ok(explanations) => (explanations, None),
        Err(Error::NotEnoughData(reason)) if setup.motion_is_known() => {
            (Vec::new(), Some(Error::NotEnoughData(reason)))
        }
        Err(error) => return Err(error),
    };
    let most = explanations.iter().map(|seen| seen.samples().len()).max().unwrap_or(0);
    let mut best: Option<First> = None;
    for seen in explanations {
        let mut state = seen.state.clone();
        let Some(misfit) = place_chain(&seen.samples(), &mut state, seed, stages) else { continue };
        match complete(state, misfit, &seen.cameras, &seen.features, seed, stages) {
            Ok(first) => take_better(&mut best, first),
            Err(Error::NotEnoughData(reason)) => failure = failure.or(Some(Error::NotEnoughData(reason))),
            Err(error) => return Err(error),
        }
        if best.as_ref().is_some_and(|best| best.error < EXPLAINED) {
            break;
        }
    }
    if setup.motion_is_known()
        && best.as_ref().is_none_or(|best| best.error > EXPLAINED)
        && let Some(from) = from_motion(seed, stages)?
    {
        match complete(from.state, 0.0, &from.cameras, &from.features, seed, stages) {
            Ok(first) => take_better(&mut best, first),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    let First { error, misfit, state } = best.ok_or_else(|| failure.unwrap_or_else(|| undetermined(setup, most)))?;
    if error > EXPLAINED && misfit > UNRELATED + setup.state_angle() {
        return Err(Error::NotEnoughData(format!(
            "no chain of {} joints moves as the images show: the best is {:.0} degrees off in the median; check that readings and \
             images are of the same moments, and the order, units and kinds of the joints",
            setup.rig.robot.joints.len(),
            misfit.to_degrees()
        )));
    }
    Ok(state)
}

/// A first state, its usual error [standard deviations], and the angle between the tips of the motion and the seen ones.
struct First {
    error: f64,
    misfit: f64,
    state: State,
}

fn take_better(best: &mut Option<First>, first: First) {
    if best.as_ref().is_none_or(|best| first.error < best.error) {
        *best = Some(first);
    }
}

/// Brings in everything that is not placed yet, and fits all of it.
fn complete(
    mut state: State,
    misfit: f64,
    cameras: &[bool],
    features: &[bool],
    seed: u64,
    stages: &mut Stages<'_>,
) -> Result<First, Error> {
    let setup = stages.setup;
    join::join(setup, &mut state, cameras, features, seed)?;
    settle(setup, &mut state);
    let (freedom, _) = gauge::end_to_end(setup, &mut state, stages.priors);
    let (loss, takes_part) = (Loss::Cauchy(WIDTH), |_: usize| true);
    let stage = Stage { name: "end to end, robust", freedom: &freedom, loss, takes_part: &takes_part };
    stages.minimize(&stage, &mut state)?;
    let error = median(&mut whitened(setup, &state));
    Ok(First { error, misfit, state })
}

/// The chain where the seen tips are, or the seen tips where the known motion is. Returns the usual angle between them.
fn place_chain(seen: &[usize], state: &mut State, seed: u64, stages: &mut Stages<'_>) -> Option<f64> {
    let setup = stages.setup;
    let samples: Vec<usize> = seen.iter().copied().filter(|&sample| state.placed[sample]).collect();
    if !setup.states.chain {
        let read: Vec<Pose> = samples.iter().map(|&sample| State::new(setup).tips[sample]).collect();
        let angle = anchor(&samples, &read, state, seed)?;
        take_tips(setup, seen, state);
        Some(angle)
    } else if setup.chain_is_known() {
        let chain: Vec<Pose> = samples.iter().map(|&sample| setup.model.tip(&state.joints[sample])).collect();
        anchor(&samples, &chain, state, seed)
    } else if samples.len() < needed(setup) {
        None
    } else {
        learn_chain(&samples, state, seed, stages)
    }
}

/// Tips are where they were read; where they were not, where they are seen, or where actions lead.
fn take_tips(setup: &Setup, seen: &[usize], state: &mut State) {
    let start = State::new(setup);
    for sample in 0..setup.len() {
        let read = setup.states.exact[sample] || setup.states.poses[sample].is_some();
        let is_seen = seen.binary_search(&sample).is_ok();
        if read || !is_seen {
            state.tips[sample] = start.tips[sample];
        }
        state.placed[sample] |= is_seen;
    }
}

/// Samples without which a chain is not even tried.
fn needed(setup: &Setup) -> usize {
    setup.rig.robot.joints.len() + 2
}

fn undetermined(setup: &Setup, samples: usize) -> Error {
    Error::NotEnoughData(if samples < needed(setup) {
        format!(
            "the tip could be placed in {samples} samples, and a chain of {} joints needs at least {}",
            setup.rig.robot.joints.len(),
            needed(setup)
        )
    } else {
        format!(
            "the {samples} samples whose tip could be placed turn it about one axis only, or not at all: add samples that turn it \
             about two axes"
        )
    })
}

/// Everything that was seen moved to where the known tips of the samples are. Returns the usual angle between the two.
fn anchor(samples: &[usize], known: &[Pose], state: &mut State, seed: u64) -> Option<f64> {
    let tips: Vec<Pose> = samples.iter().map(|&sample| state.tips[sample]).collect();
    Anchor::find(&tips, known, seed)?.apply(state);
    let mut angles: Vec<f64> =
        samples.iter().zip(known).map(|(&sample, known)| known.angle_to(&state.tips[sample])).collect();
    Some(median(&mut angles))
}

/// The chain from the seen tips (eq. 5), and everything that was seen moved to where it is. Returns the usual angle
/// between the chain's tips and the seen ones.
fn learn_chain(samples: &[usize], state: &mut State, seed: u64, stages: &mut Stages<'_>) -> Option<f64> {
    let setup = stages.setup;
    let kinds = &setup.model.chain.kinds;
    let signed: Vec<Vec<f64>> = samples
        .iter()
        .map(|&sample| {
            let reversed = &setup.model.chain.reversed;
            state.joints[sample].iter().zip(reversed).map(|(j, reversed)| if *reversed { -j } else { *j }).collect()
        })
        .collect();
    let joints: Vec<&[f64]> = signed.iter().map(Vec::as_slice).collect();
    let mut tips: Vec<Pose> = samples.iter().map(|&sample| state.tips[sample]).collect();
    let rotations: Vec<_> = tips.iter().map(|tip| tip.rotation).collect();
    let started = std::time::Instant::now();
    let axes = find_axes(kinds, &joints, &rotations, GOOD_ANGLE + setup.state_angle(), seed)?;
    let mut lines = find_lines(kinds, &axes, &joints, &tips)?;
    if let Some(unit) = lines.unit {
        gauge::rescale(state, 1.0 / unit);
        tips = samples.iter().map(|&sample| state.tips[sample]).collect();
        lines = find_lines(kinds, &axes, &joints, &tips)?;
    }
    let (base, parameters) = rows(setup.model.chain.convention, kinds, &lines);
    state.model.base = base;
    state.model.parameters = parameters;
    // The tip's frame is now the chain's: what was fixed to the seen tip moves over.
    let at_zero = state.model.tip(&vec![0.0; kinds.len()]);
    let tip = at_zero.inverse() * lines.at_zero;
    Anchor { scale: 1.0, world: Pose::identity(), tip }.apply(state);
    let angles = |angles: &[f64]| 0.5 * angles.iter().map(|angle| angle * angle).sum::<f64>();
    stages.record("kinematics", axes.iterations, (angles(&axes.first_angles), angles(&axes.angles)), started);
    Some(median(&mut axes.angles.clone()))
}
