//! How far detections are from where a state predicts them.
use super::Distance;
use super::evaluate::median;
use super::graph::State;
use super::observation::{Kind, Observation};
use super::setup::Setup;

/// Distance of every observation [px, or m].
pub(crate) fn distances(setup: &Setup, state: &State) -> Vec<f64> {
    let links = state.all_links(setup);
    setup.observations.iter().map(|seen| seen.error(&state.model, &links[seen.sample]).norm()).collect()
}

/// The same in standard deviations of a coordinate.
pub(crate) fn whitened(setup: &Setup, state: &State) -> Vec<f64> {
    distances(setup, state).iter().zip(&setup.observations).map(|(d, seen)| d / setup.sd(seen.kind())).collect()
}

/// Median distance of the observations of one sample [standard deviations of a coordinate]; `None` where there is none.
pub(crate) fn median_of_sample(setup: &Setup, state: &State, sample: usize) -> Option<f64> {
    let links = state.links(setup, sample);
    let whitened = |seen: &Observation| seen.error(&state.model, &links).norm() / setup.sd(seen.kind());
    let mut all: Vec<f64> = setup.of_sample(sample).iter().map(whitened).collect();
    (!all.is_empty()).then(|| median(&mut all))
}

/// Median distance of what of one sample is chosen; of points where there are no pixels.
pub(crate) fn usual_distance(
    setup: &Setup,
    state: &State,
    sample: usize,
    is_chosen: impl Fn(&Observation) -> bool,
) -> Distance {
    let links = state.links(setup, sample);
    let of_kind = |kind: Kind| {
        let chosen = setup.of_sample(sample).iter().filter(|seen| seen.kind() == kind);
        let distance = |seen: &Observation| seen.error(&state.model, &links).norm();
        let mut all: Vec<f64> = chosen.filter(|seen| is_chosen(seen)).map(distance).collect();
        (!all.is_empty()).then(|| kind.distance(median(&mut all)))
    };
    Kind::ALL.into_iter().find_map(of_kind).unwrap_or(Distance::Pixels(0.0))
}
