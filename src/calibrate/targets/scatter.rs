//! How far reported targets are from where the model has them, and the noise that this scatter shows: its size, and how far the
//! reports drift, as those of visual odometry do.
use super::graph::{Built, State};
use super::setup::Setup;
use crate::calibrate::evaluate::median;
use crate::factors::CameraFromTarget;
use crate::rig::Parent;
use handeye_solvers::{Covariance, Factor, Function, Pose, Vector};
use std::ops::Range;

/// Gains that are tried: shares of what is new in an error that stay. None: errors of views are independent.
const GAINS: [f64; 9] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95];

/// Reports count as drifting where that raises the log-likelihood by so much (5 standard deviations), over at least so many views.
const RAISES: f64 = 12.5;
const FEWEST: usize = 20;

/// What differs from the error before by more than this [standard deviations] moves a drift no further.
const CLIPPED: f64 = 3.0;

/// Views whose leverage is computed, spread evenly over the recording.
const LEVERAGES: usize = 200;

/// Where residuals show less of the noise's variance than this, they do not tell it.
const LEAST_SHOWN: f64 = 0.25;

/// What is about equally noisy: the three coordinates of a rotation, and the two of a translation across the line of sight.
const ALIKE: [Range<usize>; 2] = [0..3, 3..5];

/// The noise of a coordinate is estimated as if so many more errors had shown what those alike show together.
const LEANS: f64 = 10.0;

/// Errors beyond so many standard deviations count as wrong detections and tell nothing of the noise.
const CUT: f64 = 3.0;

/// The share of a Gaussian's variance that those within [`CUT`] have: 1 - 2 c φ(c) / (2 Φ(c) - 1).
const WITHIN: f64 = 0.97334;

/// Rounds in which the cut follows the standard deviation.
const CUTS: usize = 5;

/// Rotations, then translations.
const GROUPS: [Range<usize>; 2] = [0..3, 3..6];

/// A view's residual without its drift: rotation [rad], then translation [m].
pub(super) fn residual(setup: &Setup, state: &State, index: usize) -> [f64; 6] {
    let (predicted, scale) = (predicted(setup, state, index), Vector::<1>::new(state.scale));
    setup.seen(index).residual::<f64>((predicted, scale, Vector::from(state.drifts[index])))
}

/// The squared size of a view's residual, in standard deviations.
pub(super) fn size(setup: &Setup, state: &State, index: usize) -> f64 {
    let r = residual(setup, state, index);
    match &setup.views[index].whitening {
        Some(rows) => rows.iter().map(|row| row.iter().zip(&r).map(|(w, r)| w * r).sum::<f64>().powi(2)).sum(),
        None => r.iter().zip(state.sigmas).map(|(r, sigma)| (r / sigma).powi(2)).sum(),
    }
}

/// Puts the noise into the state that the scatter of the views shows, and what the fit before took up of it.
///
/// The model of an error is white noise on a random walk. Its best prediction from the errors before is their exponential mean, by a
/// gain K; with σ of what is new against that, the noise is σ √(1 - K) and the walk goes by σ K (Muth 1960). K is the one under
/// which σ is least, of rotations and of translations each.
pub(super) fn estimate(setup: &Setup, state: &mut State) {
    (state.sigmas, state.walks) = noise(setup, state);
    for (k, sigma) in state.sigmas.iter_mut().enumerate().filter(|(k, _)| state.walks[k / 3] == 0.0) {
        *sigma /= state.shown[k];
    }
    for (group, _) in GROUPS.into_iter().zip(state.walks).filter(|(_, walk)| *walk == 0.0) {
        state.drifts.iter_mut().for_each(|drift| drift[group.clone()].fill(0.0));
    }
}

/// The share of the noise that residuals show after a fit: the root of 1 - h, with h the mean leverage of a coordinate.
pub(super) fn shown(setup: &Setup, built: &Built, state: &State, covariance: &mut Covariance<'_>) -> [f64; 6] {
    let views = || setup.views.iter().zip(&built.predicted).filter(|(view, _)| view.whitening.is_none());
    let every = views().count().div_ceil(LEVERAGES).max(1);
    let (mut leverages, mut n) = ([0.0; 6], 0.0_f64);
    for (view, &predicted) in views().step_by(every) {
        let of_pose = covariance.of(predicted);
        // The residual turns in the target's frame.
        let rotation = view.seen.rotation;
        let turned = rotation.transpose() * of_pose.fixed_view::<3, 3>(0, 0) * rotation;
        for (k, leverage) in leverages.iter_mut().enumerate() {
            *leverage += if k < 3 { turned[(k, k)] } else { of_pose[(k, k)] } / state.sigmas[k].powi(2);
        }
        n += 1.0;
    }
    let turn = leverages[..3].iter().sum::<f64>() / 3.0;
    leverages[..3].fill(turn);
    leverages.map(|leverage| (1.0 - leverage / n.max(1.0)).max(LEAST_SHOWN).sqrt())
}

/// Standard deviations of the six numbers, and by how much rotations and translations walk.
fn noise(setup: &Setup, state: &State) -> ([f64; 6], [f64; 2]) {
    let without = State { drifts: vec![[0.0; 6]; setup.views.len()], ..state.clone() };
    let errors: Vec<[f64; 6]> = (0..setup.views.len()).map(|index| residual(setup, &without, index)).collect();
    let independent = deviations(&errors);
    let (mut sigmas, mut walks) = (independent, [0.0; 2]);
    let n = setup.views.iter().filter(|view| view.before.is_some() && view.whitening.is_none()).count();
    if n < FEWEST {
        return (sigmas, walks);
    }
    let most = deviations(&unpredicted(setup, &errors, 1.0, &[f64::INFINITY; 6])).map(|sigma| CLIPPED * sigma);
    let mut best = [RAISES; 2];
    for gain in GAINS {
        let new = deviations(&unpredicted(setup, &errors, gain, &most));
        for (kind, group) in GROUPS.into_iter().enumerate() {
            let raised = n as f64 * group.clone().map(|k| (independent[k] / new[k]).ln()).sum::<f64>();
            if raised > best[kind] {
                best[kind] = raised;
                group.clone().for_each(|k| sigmas[k] = new[k] * (1.0 - gain).sqrt());
                walks[kind] = gain * (group.map(|k| new[k] * new[k]).sum::<f64>() / 3.0).sqrt();
            }
        }
    }
    (sigmas, walks)
}

/// What an exponential mean of the errors before does not predict of each error, where nothing new counts for more than `most`.
fn unpredicted(setup: &Setup, errors: &[[f64; 6]], gain: f64, most: &[f64; 6]) -> Vec<[f64; 6]> {
    let (mut drifts, mut new) = (vec![[0.0_f64; 6]; errors.len()], Vec::with_capacity(errors.len()));
    for (index, error) in errors.iter().enumerate() {
        let drift = setup.views[index].before.map_or([0.0; 6], |before| drifts[before]);
        let predicted = setup.seen(index).carried(&drift);
        let fresh: [f64; 6] = std::array::from_fn(|k| error[k] - predicted[k]);
        let clipped: [f64; 6] = std::array::from_fn(|k| fresh[k].clamp(-most[k], most[k]));
        let step = setup.seen(index).uncarried(&clipped);
        drifts[index] = std::array::from_fn(|k| drift[k] + gain * step[k]);
        new.push(fresh);
    }
    new
}

/// Standard deviations of the six numbers. Those of a few errors may be far off, and lean on what is like them.
fn deviations(errors: &[[f64; 6]]) -> [f64; 6] {
    let n = errors.len() as f64;
    let mut sigmas = std::array::from_fn(|k| deviation(errors, k..k + 1));
    for group in ALIKE {
        let together = deviation(errors, group.clone());
        for sigma in &mut sigmas[group] {
            *sigma = ((n * *sigma * *sigma + LEANS * together * together) / (n + LEANS)).sqrt();
        }
    }
    sigmas
}

/// Of all these coordinates together: the root mean square of those within the cut, which starts from the median.
///
/// A median alone stands as many wrong ones, and uses 37 % of what the errors tell; this uses nearly all.
fn deviation(errors: &[[f64; 6]], coordinates: Range<usize>) -> f64 {
    let mut sizes: Vec<f64> =
        errors.iter().flat_map(|r| r[coordinates.clone()].iter().map(|error| error.abs())).collect();
    // Half of a Gaussian is within 0.6745 standard deviations; not below what arithmetic leaves.
    let mut sigma = (median(&mut sizes) / 0.6745).max(1e-9);
    for _ in 0..CUTS {
        let within = || sizes.iter().filter(|size| **size < CUT * sigma);
        let squares = within().map(|size| size * size).sum::<f64>();
        sigma = (squares / within().count().max(1) as f64 / WITHIN).sqrt().max(1e-9);
    }
    sigma
}

/// `camera_from_target` of a view.
fn predicted(setup: &Setup, state: &State, index: usize) -> Pose {
    let view = &setup.views[index];
    let (camera, target) = (&setup.rig.cameras[view.camera], &setup.rig.targets[view.target]);
    let carrier = |parent: Parent| if parent == Parent::World { Pose::identity() } else { state.tips[view.moment] };
    let (carrier, mount) = (carrier(target.parent), carrier(camera.parent));
    CameraFromTarget.compute::<f64>((carrier, state.targets[view.target], mount, state.cameras[view.camera]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const TRUE: [f64; 6] = [0.002, 0.002, 0.002, 0.001, 0.001, 0.004];

    /// By how much an estimate of each coordinate is off in 200 trials: root mean square of the logarithm. A share of the errors
    /// is wrong, 20 times as large.
    fn off(n: usize, wrong: f64, estimate: fn(&[[f64; 6]]) -> [f64; 6]) -> [f64; 6] {
        let mut squares = [0.0; 6];
        for seed in 0..200 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut error = || {
                let times = if random.random::<f64>() < wrong { 20.0 } else { 1.0 };
                TRUE.map(|sigma| times * sigma * random.sample::<f64, _>(StandardNormal))
            };
            let errors: Vec<[f64; 6]> = (0..n).map(|_| error()).collect();
            for ((square, sigma), truth) in squares.iter_mut().zip(estimate(&errors)).zip(TRUE) {
                *square += (sigma / truth).ln().powi(2) / 200.0;
            }
        }
        squares.map(f64::sqrt)
    }

    /// From medians alone.
    fn medians(errors: &[[f64; 6]]) -> [f64; 6] {
        std::array::from_fn(|k| median(&mut errors.iter().map(|error| error[k].abs()).collect::<Vec<_>>()) / 0.6745)
    }

    /// The standard deviation of n Gaussian errors is known to 1 / √(2 n) at best, from a median to 1.64 times that.
    #[test]
    fn noise_of_many_views_is_nearly_as_well_known_as_can_be() {
        let alone = |errors: &[[f64; 6]]| std::array::from_fn(|k| deviation(errors, k..k + 1));
        let best = 1.0 / (2.0_f64 * 100.0).sqrt();
        let (medians, cut) = (off(100, 0.0, medians), off(100, 0.0, alone));
        for k in 0..6 {
            // 200 trials tell a root mean square to 5 %: within 3 of these.
            assert!(cut[k] < 1.25 * best, "{k}: {} where {best} is best", cut[k]);
            assert!(medians[k] > 1.4 * best, "{k}: {} from medians", medians[k]);
        }
    }

    /// Where three in ten are wrong, they count for less than in a median.
    #[test]
    fn wrong_detections_count_for_little_in_the_noise() {
        let alone = |errors: &[[f64; 6]]| std::array::from_fn(|k| deviation(errors, k..k + 1));
        let (medians, cut) = (off(100, 0.3, medians), off(100, 0.3, alone));
        for k in 0..6 {
            assert!(cut[k] < 0.5 * medians[k], "{k}: {} where medians are off by {}", cut[k], medians[k]);
        }
    }

    /// Five views tell little of one coordinate, and more of those alike; that depth is noisier is not smoothed away.
    #[test]
    fn noise_of_few_views_leans_on_what_is_like_it() {
        let alone = |errors: &[[f64; 6]]| std::array::from_fn(|k| deviation(errors, k..k + 1));
        let (alone, leaning) = (off(5, 0.0, alone), off(5, 0.0, deviations));
        for k in 0..5 {
            assert!(leaning[k] < 0.8 * alone[k], "{k}: {} from its own, {} with those alike", alone[k], leaning[k]);
        }
        assert_eq!(alone[5], leaning[5], "depth is like nothing else");
        assert!(off(400, 0.0, deviations).iter().all(|off| *off < 0.05), "{:?}", off(400, 0.0, deviations));
    }
}
