//! Ill-posed cases: positions and lengths that move together further than one would want, though the data determine them.
use super::deviations::Honest;
use super::direction::Direction;
use super::evaluate::median;
use super::gauge;
use super::graph::{Built, Freedom, State, row};
use super::weak::{Combination, DeterminedBy};
use handeye_solvers::{Component, Covariance, DynamicVector, Key, Pose, Vector};
use nalgebra::{DMatrix, DVector};

/// A case is ill-posed where lengths are known to less than this share of the distance between cameras and features.
const POOR: f64 = 0.01;

/// Weights below this share of the largest are left out.
const SMALLEST_WEIGHT: f64 = 1e-3;

/// Samples in which distances are looked at.
const SAMPLES: usize = 50;

/// A node of the rig, its free coordinates, and which of these are lengths.
struct Part {
    key: AnyKey,
    free: Vec<usize>,
    lengths: Vec<bool>,
}

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
    let (parts, sigma) = covariance_of_rig(freedom, built, covariance);
    let numbers: Vec<(usize, usize, bool)> = parts
        .iter()
        .flat_map(|part| part.free.iter().zip(&part.lengths).map(|(&k, &is_length)| (part.key.index(), k, is_length)))
        .collect();
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

/// Covariance of all free numbers of the rig but those of lenses, in the order of the parts.
fn covariance_of_rig(freedom: &Freedom, built: &Built, covariance: &mut Covariance<'_>) -> (Vec<Part>, DMatrix<f64>) {
    let part = |key: AnyKey, held: &[bool], is_length: &dyn Fn(usize) -> bool| {
        let free: Vec<usize> = (0..held.len()).filter(|&k| !held[k]).collect();
        let lengths = free.iter().map(|&k| is_length(k)).collect();
        Part { key, free, lengths }
    };
    let of_pose = |k: usize| k >= 3;
    let mut parts = vec![
        part(AnyKey::Pose(built.base), &freedom.base, &of_pose),
        part(AnyKey::Parameters(built.parameters), &freedom.parameters, &|k| matches!(k % row(1), 1 | 2)),
    ];
    for (&(pose, _), held) in built.cameras.iter().zip(&freedom.cameras) {
        parts.push(part(AnyKey::Pose(pose), held, &of_pose));
    }
    for (&feature, held) in built.features.iter().zip(&freedom.features) {
        parts.push(part(AnyKey::Point(feature), held, &|_| true));
    }
    parts.retain(|part| !part.free.is_empty());
    let firsts: Vec<usize> = parts
        .iter()
        .scan(0, |next, part| {
            let first = *next;
            *next += part.free.len();
            Some(first)
        })
        .collect();
    let n = parts.iter().map(|part| part.free.len()).sum();
    let mut sigma = DMatrix::zeros(n, n);
    for (a, &row) in parts.iter().zip(&firsts) {
        for (b, &column) in parts.iter().zip(&firsts).filter(|(_, column)| **column <= row) {
            let block = a.key.covariance_with(b.key, covariance);
            for (i, &x) in a.free.iter().enumerate() {
                for (k, &y) in b.free.iter().enumerate() {
                    sigma[(row + i, column + k)] = block[(x, y)];
                    sigma[(column + k, row + i)] = block[(x, y)];
                }
            }
        }
    }
    (parts, sigma)
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

/// The key of a node of the rig.
#[derive(Clone, Copy)]
enum AnyKey {
    Pose(Key<Pose>),
    Parameters(Key<DynamicVector>),
    Point(Key<Vector<3>>),
}

impl AnyKey {
    fn index(self) -> usize {
        match self {
            AnyKey::Pose(key) => key.index(),
            AnyKey::Parameters(key) => key.index(),
            AnyKey::Point(key) => key.index(),
        }
    }

    fn covariance_with(self, other: AnyKey, covariance: &mut Covariance<'_>) -> DMatrix<f64> {
        fn of<A>(a: Key<A>, other: AnyKey, covariance: &mut Covariance<'_>) -> DMatrix<f64> {
            match other {
                AnyKey::Pose(b) => covariance.between(a, b),
                AnyKey::Parameters(b) => covariance.between(a, b),
                AnyKey::Point(b) => covariance.between(a, b),
            }
        }
        match self {
            AnyKey::Pose(a) => of(a, other, covariance),
            AnyKey::Parameters(a) => of(a, other, covariance),
            AnyKey::Point(a) => of(a, other, covariance),
        }
    }
}
