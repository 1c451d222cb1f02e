//! Ill-posed cases: positions and lengths that move together further than one would want, though the data determine them.
use super::deviations::Honest;
use super::direction::Direction;
use super::evaluate::median;
use super::gauge;
use super::graph::{Built, Freedom, State};
use super::numbers::Numbers;
use super::weak::{Combination, DeterminedBy};
use handeye_solvers::{Component, Covariance};
use nalgebra::{DMatrix, DVector};

/// A case is ill-posed where lengths are known to less than this share of the distance between cameras and features.
const POOR: f64 = 0.01;

/// Weights below this share of the largest are left out.
const SMALLEST_WEIGHT: f64 = 1e-3;

/// Samples in which distances are looked at.
const SAMPLES: usize = 50;

/// The combination that is known worst, where it is known poorly.
///
/// With Σ the covariance of the free numbers and S that of the lengths among them, the worst direction of the lengths is S's
/// first eigenvector v, of variance λ; all numbers then follow it as Σ v / λ does.
pub(crate) fn determined(
    honest: &Honest<'_>,
    state: &State,
    freedom: &Freedom,
    built: &Built,
    covariance: &mut Covariance<'_>,
) -> Option<Combination> {
    let distance = distance(honest, state)?;
    // Lenses are not positions, and follow.
    let but_lenses = Freedom { intrinsics: vec![[true; 12]; freedom.intrinsics.len()], ..freedom.clone() };
    let free = Numbers::new(&but_lenses);
    let sigma = free.covariance(built, covariance);
    let numbers: Vec<(usize, usize, bool)> =
        free.iter().map(|(part, k)| (part.node(built), k, part.is_length(k))).collect();
    let lengths: Vec<usize> = (0..numbers.len()).filter(|&i| numbers[i].2).collect();
    if lengths.is_empty() {
        return None;
    }
    let eigen =
        DMatrix::from_fn(lengths.len(), lengths.len(), |i, k| sigma[(lengths[i], lengths[k])]).symmetric_eigen();
    let worst = eigen.eigenvalues.imax();
    let sd = eigen.eigenvalues[worst].max(0.0).sqrt();
    if sd.is_nan() || sd <= POOR * distance {
        return None;
    }
    let mut v = DVector::zeros(numbers.len());
    lengths.iter().enumerate().for_each(|(i, &at)| v[at] = eigen.eigenvectors[(i, worst)]);
    let all = &sigma * v / (sd * sd);
    let largest = lengths.iter().map(|&i| all[i]).max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let mut components: Vec<(bool, Component)> = numbers
        .iter()
        .zip(all.iter())
        .map(|(&(node, coordinate, is_length), x)| (is_length, Component { node, coordinate, weight: x / largest }))
        .filter(|(_, part)| part.weight.abs() > SMALLEST_WEIGHT)
        .collect();
    // Lengths first: they are what is poorly known.
    components.sort_by(|(a, x), (b, y)| b.cmp(a).then(y.weight.abs().total_cmp(&x.weight.abs())));
    let parts = components.into_iter().map(|(_, part)| part).collect();
    let direction = Direction { parts, sd: Some(sd * largest.abs()) };
    let metric = gauge::length_is_known(&honest.setup);
    let how = DeterminedBy::Poorly { sd, share: sd / distance, metric };
    Some(Combination::new(honest, state, built, &direction, how, true))
}

/// Median distance between a camera and what it sees.
fn distance(honest: &Honest<'_>, state: &State) -> Option<f64> {
    let setup = &honest.setup;
    let every = setup.len().div_ceil(SAMPLES).max(1);
    let seen = setup.observations.iter().filter(|seen| seen.sample % every == 0 && state.placed[seen.sample]);
    let mut distances: Vec<f64> = seen
        .map(|seen| state.model.in_camera(seen.camera, seen.feature, &state.links(setup, seen.sample)).norm())
        .collect();
    (!distances.is_empty()).then(|| median(&mut distances))
}
