//! States that nothing but their own images tell of, once the rest of the rig is about right.
use super::graph::{Freedom, State};
use super::observation::Kind;
use super::residuals::median_of_sample;
use super::setup::Setup;
use super::stage::Stages;
use handeye_solvers::{LevenbergMarquardt, Loss, Solver};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Samples with known joints and similar images from which the joints of another are looked for.
const STARTS: usize = 12;

/// Width of Cauchy's loss [standard deviations], and most iterations.
const WIDTH: f64 = 20.0;
const ITERATIONS: usize = 50;

/// Joints are found where their images fit better than this in the median [standard deviations].
const FOUND: f64 = 6.0;

/// Finds the joints of samples without readings and actions from their images, starting where images are most alike.
pub(super) fn place_unknown(state: &mut State, stages: &Stages<'_>) {
    let setup = stages.setup;
    if !setup.states.chain || state.placed.iter().all(|placed| *placed) {
        return;
    }
    let images = images(setup);
    let known: Vec<usize> = (0..setup.len()).filter(|&sample| state.placed[sample]).collect();
    for sample in (0..setup.len()).filter(|&sample| !state.placed[sample]).collect::<Vec<_>>() {
        let mut alike: Vec<(f64, usize)> =
            known.iter().filter_map(|&other| Some((apart(&images[sample], &images[other])?, other))).collect();
        alike.sort_by(|a, b| a.0.total_cmp(&b.0));
        let starts = alike.iter().take(STARTS).map(|&(_, other)| state.joints[other].clone());
        let found = starts.filter_map(|joints| from_start(setup, state, stages, sample, joints));
        if let Some((error, joints)) = found.min_by(|a, b| a.0.total_cmp(&b.0))
            && error < FOUND
        {
            state.joints[sample] = joints;
            state.placed[sample] = true;
        }
    }
}

/// Median distance [standard deviations] and joints of a sample where a start leads.
fn from_start(
    setup: &Setup,
    state: &State,
    stages: &Stages<'_>,
    sample: usize,
    joints: Vec<f64>,
) -> Option<(f64, Vec<f64>)> {
    let mut state = state.clone();
    state.placed = vec![false; setup.len()];
    state.placed[sample] = true;
    state.joints[sample] = joints;
    let mut freedom = Freedom::nothing(setup);
    freedom.states[sample] = false;
    let mut built = stages.build_on(&freedom, Loss::Cauchy(WIDTH), &state);
    let mut solver = Solver::new(&built.graph);
    let minimizer = LevenbergMarquardt { max_iterations: ITERATIONS, ..Default::default() };
    minimizer.minimize_with(&mut built.graph, &mut solver, &mut |_| ControlFlow::Continue(())).ok()?;
    built.read(&mut state);
    let error = median_of_sample(setup, &state, sample)?;
    Some((error, std::mem::take(&mut state.joints[sample])))
}

/// Where each camera sees each feature [standard deviations].
type Image = BTreeMap<(usize, usize, Kind), Vector3<f64>>;

/// What every sample's images show.
fn images(setup: &Setup) -> Vec<Image> {
    let mut images = vec![Image::new(); setup.len()];
    for seen in &setup.observations {
        images[seen.sample].insert((seen.camera, seen.feature, seen.kind()), seen.vector() / setup.sd(seen.kind()));
    }
    images
}

/// Mean distance of what two samples both show [standard deviations]; `None` for nothing.
fn apart(a: &Image, b: &Image) -> Option<f64> {
    let both = a.iter().filter_map(|(key, p)| b.get(key).map(|q| (p - q).norm()));
    let (count, sum) = both.fold((0, 0.0), |(count, sum), distance| (count + 1, sum + distance));
    (count > 0).then(|| sum / f64::from(count))
}
