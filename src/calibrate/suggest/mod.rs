//! Where to move next: the joint positions that would shrink the uncertainty of the tip most, and what they would buy.
mod knowledge;
mod known;
mod sight;
mod stand_in;

use super::deviations::Honest;
use super::graph::Priors;
use super::setup::Setup;
use super::stage::{Stage, Stages};
use super::{Fitted, LAST, fit, gauge, is_of_targets};
use crate::Error;
use crate::chain::JointKind;
use crate::reach::{Motions, Need, Views, range};
use crate::recording::Recording;
use crate::rig::{Fit, Rig};
use knowledge::{Knowledge, Uncertainty, median_deviation};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sight::Sight;
use stand_in::{Data, stand_in};
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// Random positions that are compared, and in which the tip is judged.
const POOL: usize = 200;

/// Streams of random numbers; 0 is that of simulated motions.
const POSITIONS: u64 = 1;
const STAND_IN: u64 = 2;
const DETECTION: u64 = 3;
const RUN: u64 = 4;

/// Features in view, summed over the cameras, at least.
const IN_TOTAL: usize = 4;

/// Draws of random positions that are averaged.
const RUNS: u64 = 20;

/// What to suggest.
#[derive(Clone, Debug, PartialEq)]
pub struct SuggestOptions {
    /// How many joint positions.
    pub count: usize,
    /// Seed of every random choice: the same seed gives the same positions, bit for bit.
    pub seed: u64,
    /// Joints stay within the ranges that they were in while the rig was learned, and a quarter of these ranges more to both sides.
    pub near: bool,
    /// Height in the world (z) below which no link, and nothing on the arm, is to be [m].
    pub above: Option<f64>,
}

impl Default for SuggestOptions {
    fn default() -> Self {
        SuggestOptions { count: 5, seed: 1, near: false, above: None }
    }
}

/// Where to move next, and what it would buy.
///
/// Standard deviations are those of the tip's position (root of the trace of its covariance): medians over random positions
/// within the joints' ranges that have the features in view [m, or the model's unit].
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// The positions, the most valuable first: each is the best to add to those before it.
    pub samples: Vec<SuggestedSample>,
    /// Standard deviation now, by the data.
    pub now: f64,
    /// The same with what comes from what was given or measured beside the recording, which more motions hardly change.
    pub with_priors: f64,
    /// True where something metric is known, so that lengths are in metres.
    pub metric: bool,
    /// Samples that the rig was learned from.
    pub learned_from: usize,
    /// True where these were not at hand, and random ones stood in for them.
    pub stood_in: bool,
}

/// A joint position to visit.
#[derive(Clone, Debug, PartialEq)]
pub struct SuggestedSample {
    /// One value per joint [rad or m].
    pub joints: Vec<f64>,
    /// Features that will be in view, summed over the cameras.
    pub in_view: usize,
    /// Expected standard deviation of the tip once this and all before it were recorded.
    pub tip: f64,
    /// The same with as many random positions: the root mean square over many draws.
    pub tip_random: f64,
}

/// Suggests joint positions to record next.
///
/// `learned`: a rig that was learned, with its `[fit]`. `recording`: what it was learned from. Without it the standard deviations
/// of `[fit]` tell nothing of what moves together, so as many random samples in the same ranges of the joints stand in for it,
/// and the result is a ranking more than a prediction. `known`: what was known before learning, as [`calibrate()`](super::calibrate())
/// had it; `None` is nothing but what `[estimate]` holds or knows roughly.
///
/// Positions are within the limits of the joints, else within the range that they were in while the rig was learned, and have at
/// least half of the features in view of a camera; with the recording, from the side from which they were seen. The greedy choice
/// minimises the expected variance of the tip over such positions (A-optimality). Nothing is known of obstacles but what the options say.
///
/// Errors: [`Error::Unusable`] where the rig was not learned, or nothing of it that moves the tip was, or rig and recording do not fit
/// together; [`Error::NotEnoughData`] where the recording leaves something open, or hardly any position has the features in view.
pub fn suggest(
    learned: &Rig,
    recording: Option<&Recording>,
    known: Option<&Rig>,
    options: &SuggestOptions,
) -> Result<Suggestion, Error> {
    if options.count == 0 {
        return Err(Error::Unusable("0 joint positions are asked for, at least 1 is needed".into()));
    }
    let fit_of = learned.fit.as_ref().ok_or_else(|| {
        Error::Unusable(
            "the rig has no [fit], so nothing says how well it is known: calibrate writes rigs that have it".into(),
        )
    })?;
    let started = known.cloned().unwrap_or_else(|| known::held_alone(learned));
    let stood_in = recording.is_none();
    let Data { recording, noise, thinned } = match recording {
        Some(recording) => Data { recording: Cow::Borrowed(recording), noise: learned.noise, thinned: 1.0 },
        None => stand_in(learned, fit_of, options.seed)?,
    };
    if is_of_targets(&recording) {
        return Err(Error::Unusable(
            "the recording is one of targets, and suggestions are made for features in images".into(),
        ));
    }
    let setup = Setup::new(&Rig { noise, ..started }, &recording)?;
    let priors = Priors::new(&setup);
    let mut observer = |_: &super::Progress<'_>| ControlFlow::Continue(());
    let mut stages = Stages::new(&setup, &priors, super::Options::default().iterations, &mut observer);
    let start = known::start(&setup, learned)?;
    let Fitted { state, mut freedom, mut verdict, loss, .. } = fit(&mut stages, Some(start), options.seed)?;
    known::leave_out_unused(&setup, &mut freedom, &mut verdict, fit_of);
    known::check_freedom(&setup, &freedom, fit_of, known.is_some())?;
    let takes_part = |index: usize| verdict.active[index];
    let last = Stage { name: LAST, freedom: &freedom, loss, takes_part: &takes_part };
    let honest = Honest::new(&stages, &last, &state, &verdict);
    let uncertainty = Uncertainty::new(&honest, &freedom, &state, &verdict)?;

    let mut views = Views::new(&setup.rig, &state.model, need(&setup.rig))?;
    if !stood_in {
        let used = setup.observations.iter().zip(&verdict.active).filter(|(_, active)| **active).map(|(seen, _)| seen);
        views = views.facing(used.map(|seen| (seen.camera, seen.feature, &state.joints[seen.sample][..])));
    }
    let views = views.above(options.above);
    let sight = Sight::new(&honest, &uncertainty.numbers, &state, &verdict, &views, thinned);
    let mut motions =
        Motions::new(&setup.rig, &views, ranges(&setup.rig, fit_of, options.near)?, stream(options.seed, POSITIONS));
    let pool = (0..POOL).map(|_| motions.draw()).collect::<Result<Vec<_>, _>>()?;
    let tips: Vec<DMatrix<f64>> = pool.iter().map(|joints| sight.tip(joints)).collect();
    let with_priors = median_deviation(&tips, &uncertainty.sigma);
    let now = Knowledge::new(&uncertainty, tips);
    let deviation = now.tip();
    let mut samples = choose(now, &sight, &mut motions, &pool, options);
    samples.iter_mut().for_each(|sample| turn_back(&mut sample.joints, &setup.rig, fit_of));
    Ok(Suggestion {
        now: deviation,
        with_priors,
        samples,
        metric: gauge::length_is_known(&setup),
        learned_from: fit_of.samples,
        stood_in,
    })
}

/// Half of the features in one camera: so many are told apart and tracked.
fn need(rig: &Rig) -> Need {
    let n_features = rig.features.len();
    Need { in_one: n_features.div_ceil(2), in_total: n_features.min(IN_TOTAL), ..Need::default() }
}

/// How much of its range a joint may leave it by, where it is to stay near.
const NEAR: f64 = 0.25;

/// Where every joint may be: within its limits, or, where it has none, within the range that it was in while the rig was learned; within
/// the limits and near that range where `near` says so.
fn ranges(rig: &Rig, fit: &Fit, near: bool) -> Result<Vec<[f64; 2]>, Error> {
    let joints = rig.robot.joints.iter().enumerate();
    joints
        .map(|(index, joint)| {
            let seen = fit.joints.get(index).copied();
            let [lower, upper] = range(joint, seen)?;
            let [least, most] = seen.filter(|_| near).unwrap_or([lower, upper]);
            let more = if near { NEAR * (most - least) } else { 0.0 };
            // What was learned from was within the limits, or these are not the arm's.
            Ok([lower.max(least - more).min(most), upper.min(most + more).max(least)])
        })
        .collect()
}

/// Brings revolute joints back by whole turns to near where they were while the rig was learned, where their limits permit it.
fn turn_back(joints: &mut [f64], rig: &Rig, fit: &Fit) {
    for ((value, joint), [least, most]) in joints.iter_mut().zip(&rig.robot.joints).zip(&fit.joints) {
        let [lower, upper] = [joint.limits.lower.unwrap_or(*least), joint.limits.upper.unwrap_or(*most)];
        let turned = *value - TAU * ((*value - 0.5 * (least + most)) / TAU).round();
        if joint.kind == JointKind::Revolute && (lower..=upper).contains(&turned) {
            *value = turned;
        }
    }
}

/// Random numbers of their own for every purpose.
fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number);
    random
}

/// Takes the best position, and again with what that would tell; beside it, what random ones would.
fn choose(
    now: Knowledge,
    sight: &Sight<'_>,
    motions: &mut Motions<'_>,
    pool: &[Vec<f64>],
    options: &SuggestOptions,
) -> Vec<SuggestedSample> {
    let rows: Vec<DMatrix<f64>> = pool.par_iter().map(|joints| sight.rows(joints)).collect();
    let random = random(&now, &rows, options);
    let mut knowledge = now;
    let mut samples = Vec::new();
    for tip_random in random {
        let gains: Vec<f64> = rows.par_iter().map(|rows| knowledge.gain(rows)).collect();
        let best = (0..gains.len()).max_by(|&a, &b| gains[a].total_cmp(&gains[b]).then(b.cmp(&a)));
        let Some(best) = best else { break };
        let joints = motions.climb(&pool[best], |joints| knowledge.gain(&sight.rows(joints)));
        knowledge.learn(&sight.rows(&joints));
        let in_view = sight.detections(&joints).len();
        samples.push(SuggestedSample { joints, in_view, tip: knowledge.tip(), tip_random });
    }
    samples
}

/// Standard deviation of the tip after one random position, after two, and so on.
fn random(now: &Knowledge, rows: &[DMatrix<f64>], options: &SuggestOptions) -> Vec<f64> {
    let run = |run: u64| -> Vec<f64> {
        let mut random = stream(options.seed, RUN + run);
        let mut knowledge = now.clone();
        let after = |_| {
            knowledge.learn(&rows[random.random_range(0..rows.len())]);
            knowledge.tip().powi(2)
        };
        (0..options.count).map(after).collect()
    };
    let runs: Vec<Vec<f64>> = (0..RUNS).into_par_iter().map(run).collect();
    (0..options.count).map(|k| (runs.iter().map(|run| run[k]).sum::<f64>() / runs.len() as f64).sqrt()).collect()
}
