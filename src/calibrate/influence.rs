//! How much the result hangs on every sample.
use super::deviations::Honest;
use super::gauge;
use super::graph::{Freedom, State, build};
use super::outliers::{Verdict, distances};
use handeye_solvers::{GaussNewton, Solver};
use nalgebra::Vector3;
use rayon::prelude::*;

/// What leaving out a sample would change, and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Index of the sample in the recording, from 0.
    pub sample: usize,
    /// How far the tip would move: root mean square over the recorded samples, after one Gauss-Newton step [m, or the model's
    /// unit where nothing metric is known]. `None` where the others do not determine the rig without it.
    pub tip: Option<f64>,
    /// Root mean square pixel distance of its detections [px].
    pub rms_px: f64,
}

/// Samples whose tips are compared, spread evenly over the recording.
const TIPS: usize = 100;

/// Of every sample that has a detection in use, in the order of the recording.
///
/// One step of the same graph without the sample's detections, from where the fit with them ended: the first-order change of
/// a fit without the sample, its leverage included.
pub(crate) fn influence(honest: &Honest<'_>, freedom: &Freedom, state: &State, verdict: &Verdict) -> Vec<Influence> {
    let setup = &honest.setup;
    let freedom = gauge::with_frames_held(setup, freedom);
    let every = setup.len().div_ceil(TIPS).max(1);
    let tips = |state: &State| -> Vec<Vector3<f64>> {
        let tip = |sample: usize| state.links(setup, sample).last().map(|tip| tip.translation);
        (0..setup.len()).step_by(every).filter_map(tip).collect()
    };
    let before = tips(state);
    let distances = distances(setup, state);
    let of_sample = |sample: usize| -> Option<Influence> {
        let first = setup.observations.partition_point(|seen| seen.sample < sample);
        let end = setup.observations.partition_point(|seen| seen.sample <= sample);
        let squares: Vec<f64> = (first..end).filter(|&i| verdict.active[i]).map(|i| distances[i].powi(2)).collect();
        if squares.is_empty() {
            return None;
        }
        let takes_part = |index: usize| verdict.active[index] && !(first..end).contains(&index);
        let mut built = build(setup, state, &freedom, honest.priors, honest.loss, takes_part);
        let step = GaussNewton { max_iterations: 1, halvings: 0, ..GaussNewton::default() };
        let mut solver = Solver::new(&built.graph);
        let stepped =
            step.minimize_with(&mut built.graph, &mut solver, &mut |_| std::ops::ControlFlow::Continue(())).is_ok();
        let moved = stepped.then(|| {
            let mut without = state.clone();
            built.read(&mut without);
            // The sample's own state is no longer seen where it is free; the rig decides.
            without.joints.clone_from(&state.joints);
            let square: f64 = tips(&without).iter().zip(&before).map(|(a, b)| (a - b).norm_squared()).sum();
            (square / before.len().max(1) as f64).sqrt()
        });
        let rms_px = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        Some(Influence { sample: setup.samples[sample], tip: moved.filter(|tip| tip.is_finite()), rms_px })
    };
    (0..setup.len()).into_par_iter().filter_map(of_sample).collect()
}

/// The most influential, the largest first.
pub fn most_influential(all: &[Influence], count: usize) -> Vec<Influence> {
    // What nothing can replace is the most influential of all.
    largest(all, count, |one| one.tip.unwrap_or(f64::INFINITY))
}

/// The worst-fitting, the largest error first.
pub fn worst_fitting(all: &[Influence], count: usize) -> Vec<Influence> {
    largest(all, count, |one| one.rms_px)
}

fn largest(all: &[Influence], count: usize, by: impl Fn(&Influence) -> f64) -> Vec<Influence> {
    let mut sorted = all.to_vec();
    sorted.sort_by(|a, b| by(b).total_cmp(&by(a)).then(a.sample.cmp(&b.sample)));
    sorted.truncate(count);
    sorted
}
