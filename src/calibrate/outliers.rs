//! Which detections, images, samples and cameras do not fit, once a robust fit stands.
use super::Finding;
use super::evaluate::median;
use super::graph::State;
use super::setup::Setup;
use nalgebra::Vector2;
use std::collections::{BTreeMap, BTreeSet};

/// What is left out, and why.
#[derive(Clone, Debug)]
pub(crate) struct Verdict {
    /// Observations that take part.
    pub active: Vec<bool>,
    pub findings: Vec<Finding>,
    /// Cameras that moved: their images take no part in the fit of anything else.
    pub moved: Vec<bool>,
    /// Observations of moved cameras, wrong images and samples with wrong joints.
    pub left_out: Vec<bool>,
}

impl Verdict {
    /// Everything takes part.
    pub fn all(setup: &Setup) -> Verdict {
        let n = setup.observations.len();
        Verdict {
            active: vec![true; n],
            findings: Vec::new(),
            moved: vec![false; setup.rig.cameras.len()],
            left_out: vec![false; n],
        }
    }
}

/// A detection is wrong beyond this many standard deviations; those between are left to the loss.
const DETECTION: f64 = 10.0;

/// An image belongs to another pose where its median is beyond this many: less may be a robot that does not repeat itself.
const IMAGE: f64 = 10.0;

/// Detections that an image must have to be judged as a whole.
const IN_IMAGE: usize = 3;

/// Samples with wrong joints among which swapped pairs are looked for, at most.
const SWAPPED: usize = 40;

/// A camera was bumped, rather than its images mistaken, where at least this many are wrong and make up more than this share of
/// all or are the first or the last.
const BUMPED: usize = 4;
const MISTAKES: f64 = 0.2;

/// Images count as shifted where the squares of their mean errors are this many times what noise explains.
const SHIFTED: f64 = 4.0;

/// A camera's images are further off than the others' where their usual distance is this many times as large.
const FURTHER: f64 = 2.0;

/// Median of |x| for a two-dimensional Gaussian of unit variance per axis.
const MEDIAN_DISTANCE: f64 = 1.177_410_022_515_474_6;

/// Judges every observation by its distance [px] under a robust fit.
///
/// The yardstick is the stated noise, or the fit's own scatter (from the median distance) where that is larger.
pub(crate) fn judge(setup: &Setup, state: &State, left_out: &[bool], moved: &[bool]) -> Verdict {
    let distances = distances(setup, state);
    let known = setup.observations.iter().map(|seen| state.placed[seen.sample]);
    let used = distances.iter().zip(left_out).zip(known).filter(|((_, out), known)| !**out && *known);
    let mut counted: Vec<f64> = used.map(|((distance, _), _)| *distance).collect();
    let sigma = (median(&mut counted) / MEDIAN_DISTANCE).max(setup.sigma());
    let mut images: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for (seen, distance) in setup.observations.iter().zip(&distances) {
        images.entry((seen.sample, seen.camera)).or_default().push(*distance);
    }
    let medians: BTreeMap<(usize, usize), f64> = images
        .into_iter()
        .filter(|(_, distances)| distances.len() >= IN_IMAGE)
        .map(|(key, mut distances)| (key, median(&mut distances)))
        .collect();
    let bad = |key: &(usize, usize)| medians.get(key).is_some_and(|median| *median > IMAGE * sigma);
    let of_sample = |sample: usize| medians.range((sample, 0)..=(sample, usize::MAX)).map(|(key, _)| *key);

    let mut verdict = Verdict {
        active: vec![true; distances.len()],
        findings: Vec::new(),
        moved: moved.to_vec(),
        left_out: Vec::new(),
    };
    let mut wrong_joints = BTreeSet::new();
    let mut wrong_images = BTreeSet::new();
    for sample in (0..setup.len()).filter(|&sample| state.placed[sample]) {
        let images: Vec<(usize, usize)> = of_sample(sample).filter(|key| !verdict.moved[key.1]).collect();
        let wrong: Vec<(usize, usize)> = images.iter().copied().filter(|key| bad(key)).collect();
        if !wrong.is_empty() && wrong.len() == images.len() {
            wrong_joints.insert(sample);
        } else {
            wrong_images.extend(wrong);
        }
    }
    for camera in bumped_cameras(&verdict.moved, &medians, &wrong_images) {
        verdict.moved[camera] = true;
        wrong_images.retain(|image| image.1 != camera);
    }
    let mut single = 0;
    for ((index, seen), distance) in setup.observations.iter().enumerate().zip(&distances) {
        let with_others = !state.placed[seen.sample]
            || verdict.moved[seen.camera]
            || wrong_joints.contains(&seen.sample)
            || wrong_images.contains(&(seen.sample, seen.camera));
        let alone = *distance > DETECTION * sigma;
        verdict.left_out.push(with_others);
        verdict.active[index] = !with_others && !alone;
        single += usize::from(!with_others && alone);
    }
    report(setup, state, &medians, &wrong_joints, &wrong_images, sigma, &mut verdict);
    let unknown = state.placed.iter().zip(&setup.samples).filter(|(placed, _)| !**placed);
    verdict.findings.extend(unknown.map(|(_, &sample)| Finding::UnknownState { sample }));
    if single > 0 {
        verdict.findings.push(Finding::Outliers { count: single, of: distances.len() });
    }
    verdict
}

/// Cameras with too many wrong images for mistakes: many of all, or all from some sample on, or all up to one.
fn bumped_cameras(
    moved: &[bool],
    medians: &BTreeMap<(usize, usize), f64>,
    wrong_images: &BTreeSet<(usize, usize)>,
) -> Vec<usize> {
    let mut bumped = Vec::new();
    for camera in (0..moved.len()).filter(|&camera| !moved[camera]) {
        let wrong: Vec<bool> =
            medians.keys().filter(|key| key.1 == camera).map(|key| wrong_images.contains(key)).collect();
        let count = wrong.iter().filter(|wrong| **wrong).count();
        let at_one_end = wrong[..count].iter().all(|wrong| *wrong) || wrong[wrong.len() - count..].iter().all(|w| *w);
        let others = moved.iter().filter(|moved| !**moved).count() - bumped.len();
        if others > 1 && count >= BUMPED && (at_one_end || count as f64 > MISTAKES * wrong.len() as f64) {
            bumped.push(camera);
        }
    }
    bumped
}

/// Distance of every observation from where the state predicts it [px].
pub(crate) fn distances(setup: &Setup, state: &State) -> Vec<f64> {
    let links = state.all_links(setup);
    let distance = |seen: &super::setup::Observation| {
        let [u, v] = state.model.pixel(seen.camera, seen.feature, &links[seen.sample]);
        (u - seen.pixel[0]).hypot(v - seen.pixel[1])
    };
    setup.observations.iter().map(distance).collect()
}

/// The same for one sample.
pub(crate) fn distances_of(setup: &Setup, state: &State, sample: usize) -> Vec<f64> {
    let links = state.links(setup, sample);
    let of_sample = setup.observations.iter().filter(|seen| seen.sample == sample);
    let distance = |seen: &super::setup::Observation| {
        let [u, v] = state.model.pixel(seen.camera, seen.feature, &links);
        (u - seen.pixel[0]).hypot(v - seen.pixel[1])
    };
    of_sample.map(distance).collect()
}

/// The camera that moved: its images are shifted as a whole by more than the noise of their detections explains, and lie
/// further off than those of the other cameras. The worst, where there are several.
pub(crate) fn moved_camera(setup: &Setup, state: &State, verdict: &Verdict) -> Option<usize> {
    let links = state.all_links(setup);
    let mut images: BTreeMap<(usize, usize), Vec<Vector2<f64>>> = BTreeMap::new();
    for (seen, _) in setup.observations.iter().zip(&verdict.left_out).filter(|(_, out)| !**out) {
        let predicted = state.model.pixel(seen.camera, seen.feature, &links[seen.sample]);
        images
            .entry((seen.camera, seen.sample))
            .or_default()
            .push(Vector2::from(predicted) - Vector2::from(seen.pixel));
    }
    let usual_distance = |select: &dyn Fn(usize) -> bool| {
        let of_image = |errors: &Vec<Vector2<f64>>| median(&mut errors.iter().map(|e| e.norm()).collect::<Vec<_>>());
        let mut distances: Vec<f64> =
            images.iter().filter(|(key, _)| select(key.0)).map(|(_, errors)| of_image(errors)).collect();
        median(&mut distances)
    };
    let ratio = |camera: usize| {
        let others = usual_distance(&|other| other != camera);
        usual_distance(&|other| other == camera) / others.max(MEDIAN_DISTANCE * setup.sigma())
    };
    let shift = |camera: usize| {
        let of_camera = images.iter().filter(|(key, errors)| key.0 == camera && errors.len() >= IN_IMAGE);
        median(&mut of_camera.map(|(_, errors)| shift(errors)).collect::<Vec<_>>())
    };
    let still = (0..verdict.moved.len()).filter(|&camera| !verdict.moved[camera]);
    let candidates: Vec<(usize, f64)> = still.map(|camera| (camera, ratio(camera))).collect();
    let worst = candidates.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (candidates.len() > 1 && worst.1 > FURTHER && shift(worst.0) > SHIFTED).then_some(worst.0)
}

/// |mean error|² of an image over what independent errors of their scatter would give it: 1 on average for good data.
fn shift(errors: &[Vector2<f64>]) -> f64 {
    let n = errors.len() as f64;
    let shift = errors.iter().sum::<Vector2<f64>>().norm_squared() / n;
    let squares: f64 = errors.iter().map(Vector2::norm_squared).sum();
    shift * (n - 1.0) / (squares - shift).max(1e-12)
}

fn report(
    setup: &Setup,
    state: &State,
    medians: &BTreeMap<(usize, usize), f64>,
    wrong_joints: &BTreeSet<usize>,
    wrong_images: &BTreeSet<(usize, usize)>,
    sigma: f64,
    verdict: &mut Verdict,
) {
    let name = |sample: usize| setup.samples[sample];
    for &sample in wrong_joints {
        // Both ways round.
        let fits = |other: &&usize| {
            **other != sample
                && median_with_joints_of(setup, state, &verdict.moved, sample, **other) < 2.0 * IMAGE * sigma
                && median_with_joints_of(setup, state, &verdict.moved, **other, sample) < 2.0 * IMAGE * sigma
        };
        let median_px = median_with_joints_of(setup, state, &verdict.moved, sample, sample);
        let swapped_with = wrong_joints.iter().take(SWAPPED).find(fits).map(|&other| name(other));
        let by_pose = !setup.states.chain;
        verdict.findings.push(Finding::WrongJoints { sample: name(sample), median_px, swapped_with, by_pose });
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
    let links = state.links(setup, joints);
    let of_sample = setup.observations.iter().filter(|seen| seen.sample == sample && !moved[seen.camera]);
    let mut distances: Vec<f64> = of_sample
        .map(|seen| {
            let [u, v] = state.model.pixel(seen.camera, seen.feature, &links);
            (u - seen.pixel[0]).hypot(v - seen.pixel[1])
        })
        .collect();
    if distances.is_empty() { f64::INFINITY } else { median(&mut distances) }
}
