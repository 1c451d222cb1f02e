//! Which detections, images, samples and cameras do not fit, once a robust fit stands.
use super::Finding;
use super::evaluate::median;
use super::graph::State;
use super::setup::Setup;
use std::collections::BTreeMap;

/// What is left out, and why.
#[derive(Clone, Debug, Default)]
pub(crate) struct Verdict {
    /// Observations that take part.
    pub active: Vec<bool>,
    pub findings: Vec<Finding>,
    /// Cameras that moved: their images take no part in the fit of anything else.
    pub moved: Vec<bool>,
}

/// A detection is wrong beyond this many standard deviations of the fit: one in 260,000 good ones is.
const DETECTION: f64 = 5.0;

/// An image is wrong where its median is beyond this many.
const IMAGE: f64 = 6.0;

/// A camera moved where this share of its images is wrong and their samples' other images are not.
const MOVED: f64 = 0.3;

/// Median of |x| for a two-dimensional Gaussian of unit variance per axis.
const MEDIAN_DISTANCE: f64 = 1.177_410_022_515_474_6;

/// Judges every observation by its distance [px] under a robust fit.
///
/// The fit's own scatter, from the median distance, is the yardstick, so that a wrongly stated noise does not make good
/// data bad; it is no less than half of the stated one.
pub(crate) fn judge(setup: &Setup, state: &State, left_out: &[bool]) -> Verdict {
    let distances = distances(setup, state);
    let mut counted: Vec<f64> = distances.iter().zip(left_out).filter(|(_, out)| !**out).map(|(d, _)| *d).collect();
    let sigma = (median(&mut counted) / MEDIAN_DISTANCE).max(0.5 * setup.sigma());
    let mut images: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for (seen, distance) in setup.observations.iter().zip(&distances) {
        images.entry((seen.sample, seen.camera)).or_default().push(*distance);
    }
    let medians: BTreeMap<(usize, usize), f64> =
        images.into_iter().map(|(key, mut distances)| (key, median(&mut distances))).collect();
    let bad = |key: &(usize, usize)| medians.get(key).is_some_and(|median| *median > IMAGE * sigma);
    let of_sample = |sample: usize| medians.range((sample, 0)..=(sample, usize::MAX)).map(|(key, _)| *key);

    let moved = moved_cameras(setup, &medians, &bad);
    let mut verdict = Verdict { active: vec![true; distances.len()], findings: Vec::new(), moved };
    let mut wrong_joints = Vec::new();
    let mut wrong_images = Vec::new();
    for sample in 0..setup.joints.len() {
        let images: Vec<(usize, usize)> = of_sample(sample).filter(|key| !verdict.moved[key.1]).collect();
        let wrong: Vec<(usize, usize)> = images.iter().copied().filter(|key| bad(key)).collect();
        if !wrong.is_empty() && wrong.len() == images.len() {
            wrong_joints.push(sample);
        } else {
            wrong_images.extend(wrong);
        }
    }
    let mut single = 0;
    for ((index, seen), distance) in setup.observations.iter().enumerate().zip(&distances) {
        let with_others = verdict.moved[seen.camera]
            || wrong_joints.contains(&seen.sample)
            || wrong_images.contains(&(seen.sample, seen.camera));
        let alone = *distance > DETECTION * sigma;
        verdict.active[index] = !with_others && !alone;
        single += usize::from(!with_others && alone);
    }
    report(setup, state, &medians, &wrong_joints, &wrong_images, sigma, &mut verdict);
    if single > 0 {
        verdict.findings.push(Finding::Outliers { count: single, of: distances.len() });
    }
    verdict
}

/// Distance of every observation from where the state predicts it [px].
pub(crate) fn distances(setup: &Setup, state: &State) -> Vec<f64> {
    let links: Vec<_> = setup.joints.iter().map(|joints| state.model.links(joints)).collect();
    let distance = |seen: &super::setup::Observation| {
        let [u, v] = state.model.pixel(seen.camera, seen.feature, &links[seen.sample]);
        (u - seen.pixel[0]).hypot(v - seen.pixel[1])
    };
    setup.observations.iter().map(distance).collect()
}

fn moved_cameras(
    setup: &Setup,
    medians: &BTreeMap<(usize, usize), f64>,
    bad: &impl Fn(&(usize, usize)) -> bool,
) -> Vec<bool> {
    let n_cameras = setup.rig.cameras.len();
    let of_camera = |camera: usize| medians.keys().filter(move |key| key.1 == camera);
    let share_of_bad = |camera: usize| {
        // Only where another camera says that the sample's joints are right.
        let others = |sample: usize| {
            (0..n_cameras)
                .any(|other| other != camera && medians.contains_key(&(sample, other)) && !bad(&(sample, other)))
        };
        let judged: Vec<_> = of_camera(camera).filter(|key| others(key.0)).collect();
        let wrong = judged.iter().filter(|key| bad(key)).count();
        (wrong >= 3).then(|| wrong as f64 / judged.len() as f64).unwrap_or(0.0)
    };
    let shares: Vec<f64> = (0..n_cameras).map(share_of_bad).collect();
    // At least one camera stays: the one that fits best.
    let keep = (0..n_cameras).min_by(|&a, &b| shares[a].total_cmp(&shares[b])).unwrap_or(0);
    (0..n_cameras).map(|camera| camera != keep && shares[camera] > MOVED).collect()
}

fn report(
    setup: &Setup,
    state: &State,
    medians: &BTreeMap<(usize, usize), f64>,
    wrong_joints: &[usize],
    wrong_images: &[(usize, usize)],
    sigma: f64,
    verdict: &mut Verdict,
) {
    let name = |sample: usize| setup.samples[sample];
    for &sample in wrong_joints {
        let fits = |other: &&usize| {
            **other != sample
                && median_with_joints_of(setup, state, &verdict.moved, sample, **other) < 2.0 * IMAGE * sigma
                && median_with_joints_of(setup, state, &verdict.moved, **other, sample) < 2.0 * IMAGE * sigma
        };
        let median_px = median_with_joints_of(setup, state, &verdict.moved, sample, sample);
        let swapped_with = wrong_joints.iter().find(fits).map(|&other| name(other));
        verdict.findings.push(Finding::WrongJoints { sample: name(sample), median_px, swapped_with });
    }
    for &(sample, camera) in wrong_images {
        verdict.findings.push(Finding::WrongImage {
            sample: name(sample),
            camera: setup.rig.cameras[camera].name.clone(),
            median_px: medians[&(sample, camera)],
        });
    }
    for (camera, _) in verdict.moved.iter().enumerate().filter(|(_, moved)| **moved) {
        let images = medians.iter().filter(|(key, _)| key.1 == camera && !wrong_joints.contains(&key.0));
        if let Some((key, largest)) = images.max_by(|a, b| a.1.total_cmp(b.1)) {
            verdict.findings.push(Finding::CameraMoved {
                camera: setup.rig.cameras[camera].name.clone(),
                largest_px: *largest,
                sample: name(key.0),
            });
        }
    }
}

/// Median distance of what a sample's images show from what another sample's joints predict [px].
fn median_with_joints_of(setup: &Setup, state: &State, moved: &[bool], sample: usize, joints: usize) -> f64 {
    let links = state.model.links(&setup.joints[joints]);
    let of_sample = setup.observations.iter().filter(|seen| seen.sample == sample && !moved[seen.camera]);
    let mut distances: Vec<f64> = of_sample
        .map(|seen| {
            let [u, v] = state.model.pixel(seen.camera, seen.feature, &links);
            (u - seen.pixel[0]).hypot(v - seen.pixel[1])
        })
        .collect();
    if distances.is_empty() { f64::INFINITY } else { median(&mut distances) }
}
