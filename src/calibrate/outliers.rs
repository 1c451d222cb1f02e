//! Which detections, images, samples and cameras do not fit, once a robust fit stands.
use super::Finding;
use super::evaluate::median;
use super::graph::State;
use super::observation::{Kind, Observation};
use super::residuals::{distances, usual_distance};
use super::setup::Setup;
use nalgebra::Vector3;
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
pub(crate) const IN_IMAGE: usize = 3;

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

/// An image: its sample, its camera, and whether its pixels or its points are meant.
pub(crate) type Image = (usize, usize, Kind);

fn image_of(seen: &Observation) -> Image {
    (seen.sample, seen.camera, seen.kind())
}

/// Judges every observation by its distance under a robust fit.
///
/// The yardstick is the stated noise, or the fit's own scatter (from the median distance) where that is larger.
pub(crate) fn judge(setup: &Setup, state: &State, left_out: &[bool], moved: &[bool]) -> Verdict {
    let mut distances = distances(setup, state);
    let yardsticks = yardsticks(setup, state, left_out, &distances);
    for (distance, seen) in distances.iter_mut().zip(&setup.observations) {
        *distance /= yardsticks(seen.kind());
    }
    let mut images: BTreeMap<Image, Vec<f64>> = BTreeMap::new();
    for (seen, distance) in setup.observations.iter().zip(&distances) {
        images.entry(image_of(seen)).or_default().push(*distance);
    }
    let medians: BTreeMap<Image, f64> = images
        .into_iter()
        .filter(|(_, distances)| distances.len() >= IN_IMAGE)
        .map(|(key, mut distances)| (key, median(&mut distances)))
        .collect();
    let judged = (0..setup.len()).filter(|&sample| state.placed[sample]);
    let Wrong { joints: wrong_joints, images: wrong_images, moved } = wrong(&medians, judged, moved);
    let mut verdict =
        Verdict { active: vec![true; distances.len()], findings: Vec::new(), moved, left_out: Vec::new() };
    let mut single = 0;
    for ((index, seen), distance) in setup.observations.iter().enumerate().zip(&distances) {
        let with_others = !state.placed[seen.sample]
            || verdict.moved[seen.camera]
            || wrong_joints.contains(&seen.sample)
            || wrong_images.contains(&image_of(seen));
        let alone = is_wrong(*distance, 1.0);
        verdict.left_out.push(with_others);
        verdict.active[index] = !with_others && !alone;
        single += usize::from(!with_others && alone);
    }
    report(setup, state, &medians, &wrong_joints, &wrong_images, &yardsticks, &mut verdict);
    let unknown = state.placed.iter().zip(&setup.samples).filter(|(placed, _)| !**placed);
    verdict.findings.extend(unknown.map(|(_, &sample)| Finding::UnknownState { sample }));
    if single > 0 {
        verdict.findings.push(Finding::Outliers { count: single, of: distances.len() });
    }
    verdict
}

/// About the standard deviation of a coordinate of one kind of detection: what is stated, or the usual distance where that is larger [px, or m].
pub(crate) fn yardstick(kind: Kind, stated: f64, distances: &mut [f64]) -> f64 {
    (median(distances) / kind.median_distance()).max(stated)
}

/// True for a detection that is wrong by itself.
pub(crate) fn is_wrong(distance: f64, yardstick: f64) -> bool {
    distance > DETECTION * yardstick
}

/// Images of a sample.
pub(crate) fn images_of(medians: &BTreeMap<Image, f64>, sample: usize) -> impl Iterator<Item = (&Image, &f64)> {
    medians.range((sample, 0, Kind::Pixels)..=(sample, usize::MAX, Kind::Points))
}

/// The other of two samples whose readings were swapped, among the first that are wrong. `fits(images, read)`: whether the images of one fit what
/// was read in another.
pub(crate) fn swapped_with(
    wrong: &BTreeSet<usize>,
    sample: usize,
    fits: impl Fn(usize, usize) -> bool,
) -> Option<usize> {
    let mut among = wrong.iter().copied().take(SWAPPED);
    let is_among = among.clone().any(|one| one == sample);
    among.find(|&other| is_among && other != sample && fits(sample, other) && fits(other, sample))
}

/// True where the distances of a sample from what another's readings predict are small [yardsticks].
pub(crate) fn fits_swapped(mut distances: Vec<f64>) -> bool {
    !distances.is_empty() && median(&mut distances) < 2.0 * IMAGE
}

/// Samples, images and cameras that do not fit.
pub(crate) struct Wrong {
    /// Samples of which no image fits.
    pub joints: BTreeSet<usize>,
    /// Of the other samples.
    pub images: BTreeSet<Image>,
    /// Whether each camera moved.
    pub moved: Vec<bool>,
}

/// Judges images by their median distances [yardsticks]. `judged`: the samples of which something is known; `moved`: cameras that are known to
/// have moved.
pub(crate) fn wrong(medians: &BTreeMap<Image, f64>, judged: impl Iterator<Item = usize>, moved: &[bool]) -> Wrong {
    let mut found = Wrong { joints: BTreeSet::new(), images: BTreeSet::new(), moved: moved.to_vec() };
    for sample in judged {
        let images: Vec<Image> = images_of(medians, sample).map(|(key, _)| *key).filter(|key| !moved[key.1]).collect();
        let wrong: Vec<Image> = images.iter().copied().filter(|key| medians[key] > IMAGE).collect();
        if !wrong.is_empty() && wrong.len() == images.len() {
            found.joints.insert(sample);
        } else {
            found.images.extend(wrong);
        }
    }
    for camera in bumped_cameras(moved, medians, &found.images) {
        found.moved[camera] = true;
        found.images.retain(|image| image.1 != camera);
    }
    found
}

/// About the standard deviation of a coordinate of each kind of detection, over those that are not left out [px, or m].
fn yardsticks(setup: &Setup, state: &State, left_out: &[bool], distances: &[f64]) -> impl Fn(Kind) -> f64 + use<> {
    let of_kind = |kind: Kind| {
        let all = setup.observations.iter().zip(distances).zip(left_out);
        let used = all.filter(|((seen, _), out)| seen.kind() == kind && !**out && state.placed[seen.sample]);
        let mut counted: Vec<f64> = used.map(|((_, distance), _)| *distance).collect();
        yardstick(kind, setup.sd(kind), &mut counted)
    };
    let both = Kind::ALL.map(of_kind);
    move |kind| both[kind as usize]
}

/// True where too many are wrong for mistakes: many of all, or all from some on, or all up to one.
fn is_change(wrong: &[bool]) -> bool {
    let count = wrong.iter().filter(|wrong| **wrong).count();
    let at_one_end = wrong[..count].iter().all(|wrong| *wrong) || wrong[wrong.len() - count..].iter().all(|w| *w);
    count >= BUMPED && (at_one_end || count as f64 > MISTAKES * wrong.len() as f64)
}

/// Cameras with too many wrong images for mistakes: many of all, or all from some sample on, or all up to one.
fn bumped_cameras(moved: &[bool], medians: &BTreeMap<Image, f64>, wrong_images: &BTreeSet<Image>) -> Vec<usize> {
    let mut bumped = Vec::new();
    for camera in (0..moved.len()).filter(|&camera| !moved[camera]) {
        // A sample counts once, whether pixels, points or both of it are wrong.
        let mut by_sample: BTreeMap<usize, bool> = BTreeMap::new();
        for key in medians.keys().filter(|key| key.1 == camera) {
            *by_sample.entry(key.0).or_default() |= wrong_images.contains(key);
        }
        let wrong: Vec<bool> = by_sample.into_values().collect();
        let others = moved.iter().filter(|moved| !**moved).count() - bumped.len();
        if others > 1 && is_change(&wrong) {
            bumped.push(camera);
        }
    }
    bumped
}

/// The camera that moved: its images are shifted as a whole by more than the noise of their detections explains, and lie
/// further off than those of the other cameras. The worst, where there are several.
pub(crate) fn moved_camera(setup: &Setup, state: &State, verdict: &Verdict) -> Option<usize> {
    let links = state.all_links(setup);
    let mut images: BTreeMap<Image, Vec<Vector3<f64>>> = BTreeMap::new();
    for (seen, _) in setup.observations.iter().zip(&verdict.left_out).filter(|(_, out)| !**out) {
        let usual = setup.sd(seen.kind()) * seen.kind().median_distance();
        images.entry(image_of(seen)).or_default().push(seen.error(&state.model, &links[seen.sample]) / usual);
    }
    let usual_distance = |select: &dyn Fn(usize) -> bool| {
        let of_image = |errors: &Vec<Vector3<f64>>| median(&mut errors.iter().map(|e| e.norm()).collect::<Vec<_>>());
        let mut distances: Vec<f64> =
            images.iter().filter(|(key, _)| select(key.1)).map(|(_, errors)| of_image(errors)).collect();
        median(&mut distances)
    };
    let ratio = |camera: usize| {
        let others = usual_distance(&|other| other != camera);
        usual_distance(&|other| other == camera) / others.max(1.0)
    };
    let shift = |camera: usize| {
        let of_camera = images.iter().filter(|(key, errors)| key.1 == camera && errors.len() >= IN_IMAGE);
        median(&mut of_camera.map(|(_, errors)| shift(errors)).collect::<Vec<_>>())
    };
    let still = (0..verdict.moved.len()).filter(|&camera| !verdict.moved[camera]);
    let candidates: Vec<(usize, f64)> = still.map(|camera| (camera, ratio(camera))).collect();
    let worst = candidates.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (candidates.len() > 1 && worst.1 > FURTHER && shift(worst.0) > SHIFTED).then_some(worst.0)
}

/// |mean error|² of an image over what independent errors of their scatter would give it: 1 on average for good data.
fn shift(errors: &[Vector3<f64>]) -> f64 {
    let n = errors.len() as f64;
    let shift = errors.iter().sum::<Vector3<f64>>().norm_squared() / n;
    let squares: f64 = errors.iter().map(Vector3::norm_squared).sum();
    shift * (n - 1.0) / (squares - shift).max(1e-12)
}

fn report(
    setup: &Setup,
    state: &State,
    medians: &BTreeMap<Image, f64>,
    wrong_joints: &BTreeSet<usize>,
    wrong_images: &BTreeSet<Image>,
    yardsticks: &impl Fn(Kind) -> f64,
    verdict: &mut Verdict,
) {
    let name = |sample: usize| setup.samples[sample];
    let moved = &verdict.moved;
    let mut findings = Vec::new();
    for &sample in wrong_joints {
        let fits = |of: usize, joints: usize| {
            fits_swapped(distances_with_joints_of(setup, state, moved, yardsticks, of, joints))
        };
        let off = usual_distance(setup, state, sample, |seen| !moved[seen.camera]);
        let swapped_with = swapped_with(wrong_joints, sample, fits).map(name);
        let by_pose = !setup.states.chain;
        findings.push(Finding::WrongJoints { sample: name(sample), off, swapped_with, by_pose });
    }
    for image in wrong_images {
        let &(sample, camera, kind) = image;
        findings.push(Finding::WrongImage {
            sample: name(sample),
            camera: setup.rig.cameras[camera].name.clone(),
            off: kind.distance(medians[image] * yardsticks(kind)),
        });
    }
    for (camera, _) in verdict.moved.iter().enumerate().filter(|(_, moved)| **moved) {
        let images = medians.iter().filter(|(key, _)| key.1 == camera && !wrong_joints.contains(&key.0));
        if let Some((key, largest)) = images.max_by(|a, b| a.1.total_cmp(b.1)) {
            findings.push(Finding::CameraMoved {
                camera: setup.rig.cameras[camera].name.clone(),
                largest: key.2.distance(*largest * yardsticks(key.2)),
                sample: name(key.0),
            });
        }
    }
    verdict.findings.extend(findings);
}

/// Distances of what a sample's images show from what another sample's joints predict [yardsticks].
fn distances_with_joints_of(
    setup: &Setup,
    state: &State,
    moved: &[bool],
    yardsticks: &impl Fn(Kind) -> f64,
    sample: usize,
    joints: usize,
) -> Vec<f64> {
    let links = state.links(setup, joints);
    let of_sample = setup.of_sample(sample).iter().filter(|seen| !moved[seen.camera]);
    let distance = |seen: &Observation| seen.error(&state.model, &links).norm() / yardsticks(seen.kind());
    of_sample.map(distance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn swapped_pairs_are_found_among_few_and_the_search_stays_short_among_many() {
        let swapped = |a: usize, b: usize| (a, b) == (3, 8) || (a, b) == (8, 3);
        let few = BTreeSet::from([1, 3, 8]);
        assert_eq!([1, 3, 8].map(|sample| swapped_with(&few, sample, swapped)), [None, Some(8), Some(3)]);
        let (many, tried) = ((0..10_000).collect(), Cell::new(0));
        for &sample in &many {
            swapped_with(&many, sample, |_, _| {
                tried.set(tried.get() + 1);
                false
            });
        }
        assert!(tried.get() <= SWAPPED * SWAPPED, "{}", tried.get());
    }
}
