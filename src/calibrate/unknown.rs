//! States that nothing but their own images tell of, once the rest of the rig is about right.
use super::evaluate::median;
use super::graph::{Freedom, State};
use super::outliers::distances_of;
use super::setup::{Observation, Setup};
use super::stage::Stages;
use handeye_solvers::{LevenbergMarquardt, Loss, Solver};
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
            && error < FOUND * setup.sigma()
        {
            state.joints[sample] = joints;
            state.placed[sample] = true;
        }
    }
}

/// Median pixel distance and joints of a sample where a start leads.
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
    let mut distances = distances_of(setup, &state, sample);
    (!distances.is_empty()).then(|| (median(&mut distances), std::mem::take(&mut state.joints[sample])))
}

type Image = BTreeMap<(usize, usize), [f64; 2]>;

/// What every sample's images show.
fn images(setup: &Setup) -> Vec<Image> {
    let mut images = vec![Image::new(); setup.len()];
    for &Observation { sample, camera, feature, pixel } in &setup.observations {
        images[sample].insert((camera, feature), pixel);
    }
    images
}

/// Mean pixel distance of what two samples both show; `None` for nothing.
fn apart(a: &Image, b: &Image) -> Option<f64> {
    let both = a.iter().filter_map(|(key, p)| b.get(key).map(|q| (p[0] - q[0]).hypot(p[1] - q[1])));
    let (count, sum) = both.fold((0, 0.0), |(count, sum), distance| (count + 1, sum + distance));
    (count > 0).then(|| sum / f64::from(count))
}
