//! How much the result hangs on every sample.
use super::gauge;
use super::graph::{State, build};
use super::observation::Kind;
use super::outliers::Verdict;
use super::residuals::distances;
use super::stage::{Stage, Stages};
use handeye_solvers::{GaussNewton, Solver};
use nalgebra::Vector3;
use rayon::prelude::*;

/// What leaving out a sample would change, and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Index of the sample in the recording, from 0.
    pub sample: usize,
    /// How far the tip would move: root mean square over the recorded samples, after one Gauss-Newton step [m, or the model's
    /// unit where nothing metric is known]; infinite where the others do not determine the rig without it. `None` where the
    /// tip does not follow from anything that is learned.
    pub tip: Option<f64>,
    /// Root mean square pixel distance of its detections [px]; 0 without pixels.
    pub rms_px: f64,
    /// Root mean square distance of its points [m]; 0 without points.
    pub rms_points_m: f64,
    /// Root mean square of all its errors, by coordinate [standard deviations].
    pub misfit: f64,
}

/// Samples whose tips are compared, spread evenly over the recording.
const TIPS: usize = 100;

/// Of every sample that has a detection in use, in the order of the recording.
///
/// One step of the same graph without the sample's detections, from where the fit with them ended: the first-order change of
/// a fit without the sample, its leverage included. Detections pull as much as they did in the fit.
pub(crate) fn influence(stages: &Stages<'_>, last: &Stage<'_>, state: &State, verdict: &Verdict) -> Vec<Influence> {
    let (setup, priors, loss) = (stages.setup, stages.priors, last.loss);
    let freedom = gauge::with_frames_held(setup, last.freedom);
    let is_learned = gauge::is_tip_learned(setup, &freedom);
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
        let used = || (first..end).filter(|&i| verdict.active[i]).map(|i| (setup.observations[i].kind(), distances[i]));
        used().next()?;
        let rms = |kind: Kind| {
            let of_kind = || used().filter(|(other, _)| *other == kind);
            (of_kind().map(|(_, d)| d * d).sum::<f64>() / of_kind().count().max(1) as f64).sqrt()
        };
        let whitened: f64 = used().map(|(kind, d)| (d / setup.sd(kind)).powi(2)).sum();
        let coordinates: f64 = used().map(|(kind, _)| kind.coordinates()).sum();
        let fits = Influence {
            sample: setup.samples[sample],
            tip: None,
            rms_px: rms(Kind::Pixels),
            rms_points_m: rms(Kind::Points),
            misfit: (whitened / coordinates).sqrt(),
        };
        if !is_learned {
            return Some(fits);
        }
        let takes_part = |index: usize| verdict.active[index] && !(first..end).contains(&index);
        let mut built = build(setup, state, &freedom, priors, loss, takes_part);
        let step = GaussNewton { max_iterations: 1, halvings: 0, ..GaussNewton::default() };
        let mut solver = Solver::new(&built.graph);
        let stepped =
            step.minimize_with(&mut built.graph, &mut solver, &mut |_| std::ops::ControlFlow::Continue(())).is_ok();
        let mut without = state.clone();
        built.read(&mut without);
        // The rig is compared, at the same joints.
        without.joints.clone_from(&state.joints);
        let square: f64 = tips(&without).iter().zip(&before).map(|(a, b)| (a - b).norm_squared()).sum();
        let moved = (square / before.len().max(1) as f64).sqrt();
        let tip = if stepped && moved.is_finite() { moved } else { f64::INFINITY };
        Some(Influence { tip: Some(tip), ..fits })
    };
    (0..setup.len()).into_par_iter().filter_map(of_sample).collect()
}

/// The most influential, the largest first; none where the tip does not follow from anything that is learned.
pub fn most_influential(all: &[Influence], count: usize) -> Vec<Influence> {
    let moving: Vec<Influence> = all.iter().filter(|one| one.tip.is_some()).copied().collect();
    // What nothing can replace is the most influential of all.
    largest(&moving, count, |one| one.tip.unwrap_or(0.0))
}

/// The worst-fitting, the largest error first.
pub fn worst_fitting(all: &[Influence], count: usize) -> Vec<Influence> {
    largest(all, count, |one| one.misfit)
}

fn largest(all: &[Influence], count: usize, by: impl Fn(&Influence) -> f64) -> Vec<Influence> {
    let mut sorted = all.to_vec();
    sorted.sort_by(|a, b| by(b).total_cmp(&by(a)).then(a.sample.cmp(&b.sample)));
    sorted.truncate(count);
    sorted
}
