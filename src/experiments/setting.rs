//! What the experiments share: the rig, its recordings, what is learned from them, and trials in parallel.
use super::Options;
use crate::Error;
use crate::calibrate::{self, Calibration, calibrate, evaluate};
use crate::recording::Recording;
use crate::rig::{Estimate, Rig, catalog};
use crate::simulate::{SimulateOptions, simulate};
use rayon::prelude::*;
use std::ops::ControlFlow;

/// In words.
pub(super) const SETTING: &str = "UR5, 12 features, 2 cameras, 0.3 px of noise per axis";

/// How far the paper's simulation can be compared.
pub(super) const NOISE_NOTE: &str = "the paper does not state the pixel noise of its simulation; ours of 0.3 px per axis is a mean distance of 0.376 px at best";

/// The paper's rig: a robot of six joints, two cameras, twelve features.
pub(super) fn rig() -> Result<Rig, Error> {
    catalog::rig("ur5")
}

/// Random positions of a complete rig with the rig's noise.
pub(super) fn record(rig: &Rig, samples: usize, seed: u64) -> Result<Recording, Error> {
    Ok(simulate(rig, &SimulateOptions { samples, seed, ..SimulateOptions::default() })?.recording)
}

/// A hundred positions that no trial learns from.
pub(super) fn held_out(rig: &Rig, seed: u64) -> Result<Recording, Error> {
    record(rig, 100, seed ^ HELD_OUT)
}

/// Tells the seeds of held-out samples from those of training.
pub(super) const HELD_OUT: u64 = 1 << 63;

/// Nothing but the noise of pixels.
pub(super) fn nothing(rig: &Rig) -> Rig {
    Rig { noise: rig.noise, estimate: Estimate::default(), ..Rig::default() }
}

/// What is learned, watched by nobody; `None` where the data do not suffice.
pub(super) fn learn(known: &Rig, recording: &Recording) -> Result<Option<Calibration>, Error> {
    let watch = &mut |_: &calibrate::Progress<'_>| ControlFlow::Continue(());
    match calibrate(known, recording, &calibrate::Options::default(), watch) {
        Ok(calibration) => Ok(Some(calibration)),
        Err(Error::NotEnoughData(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Mean pixel distance between what a rig predicts and what was seen, the paper's average pixel norm [px].
pub(super) fn mean_px(rig: &Rig, recording: &Recording) -> Result<f64, Error> {
    Ok(evaluate(rig, recording)?.total.mean_px)
}

/// One result per trial, in the order of their seeds; the first failure in that order, on any number of threads.
pub(super) fn trials<T: Send>(
    options: &Options,
    trial: impl Fn(u64) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let first = first_seed(options);
    let results: Vec<Result<T, Error>> =
        (0..options.trials as u64).into_par_iter().map(|index| trial(first.wrapping_add(index))).collect();
    results.into_iter().collect()
}

/// Seed of the first trial; those of runs with neighbouring `seed` do not overlap before a million trials.
pub(super) fn first_seed(options: &Options) -> u64 {
    options.seed.wrapping_mul(1_000_000) & !HELD_OUT
}

/// Trials by figure instead of figures by trial.
pub(super) fn columns(results: &[Vec<Option<f64>>]) -> Vec<Vec<Option<f64>>> {
    let n = results.first().map_or(0, Vec::len);
    (0..n).map(|column| results.iter().map(|row| row[column]).collect()).collect()
}

/// A ratio of published figures, to the digits that they have.
pub(super) fn thousandths(ratio: f64) -> f64 {
    (1e3 * ratio).round() / 1e3
}
