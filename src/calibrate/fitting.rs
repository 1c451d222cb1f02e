//! What of a recording does not fit a rig that is evaluated, by the tests by which a calibration leaves it out, and the errors without it.
use super::evaluate::{SampleDistances, median, of_sample};
use super::observation::Kind;
use super::outliers::{IN_IMAGE, Image, Wrong, fits_swapped, images_of, is_wrong, swapped_with, wrong, yardstick};
use super::{CameraErrors, Correspondence, Distance, Distances, Errors, Finding, SpaceErrors};
use crate::recording::{Recording, Sample};
use crate::rig::{Model, Noise, Rig};
use std::collections::BTreeMap;

/// Rounds of judging: what is left out no longer counts towards what is usual.
const ROUNDS: usize = 2;

/// A sample that is not wrong fits poorly where its median distance is beyond this many yardsticks; noise gives 1.2 to 1.5.
const POOR: f64 = 3.0;

/// Errors without what does not fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fitting {
    /// Over all cameras.
    pub total: Errors,
    /// The pixel distances as lengths, as in [`Evaluation::space`](super::Evaluation).
    pub space: Option<SpaceErrors>,
    /// Per camera of the rig, in its order, with how many of its detections do not fit.
    pub cameras: Vec<CameraErrors>,
    /// What does not fit.
    pub findings: Vec<Finding>,
    /// Samples of the rest that are far further off than is usual, the worst first: each with its median distance.
    pub poor: Vec<(usize, Distance)>,
}

impl Fitting {
    /// Of the distances of every sample.
    pub(crate) fn new(rig: &Rig, model: &Model, recording: &Recording, samples: &[SampleDistances]) -> Fitting {
        let mut yardsticks = yardsticks(&rig.noise, samples, |_, _| true);
        let mut judged = judge(rig, samples, yardsticks);
        for _ in 1..ROUNDS {
            yardsticks = self::yardsticks(&rig.noise, samples, |sample, camera| {
                Kind::ALL.into_iter().all(|kind| !is_out(&judged.0, (sample, camera, kind)))
            });
            judged = judge(rig, samples, yardsticks);
        }
        let (wrong, medians) = judged;
        let mut of_camera = vec![(Distances::default(), 0); rig.cameras.len()];
        let mut single = 0;
        for (sample, of_sample) in samples.iter().enumerate() {
            for (camera, seen) in of_sample.cameras.iter().enumerate() {
                let (used, rejected) = &mut of_camera[camera];
                let before = used.pixels.len() + used.points.len();
                let mut keep = |kind: Kind, distance: f64| {
                    let out = is_out(&wrong, (sample, camera, kind));
                    let alone = is_wrong(distance, yardsticks[kind as usize]);
                    single += usize::from(!out && alone);
                    !out && !alone
                };
                used.pixels.extend(seen.pixels.iter().filter(|pixel| keep(Kind::Pixels, pixel.px)));
                used.points.extend(seen.points.iter().filter(|distance| keep(Kind::Points, **distance)));
                *rejected += seen.pixels.len() + seen.points.len() - (used.pixels.len() + used.points.len() - before);
            }
        }
        let mut total = Distances::default();
        of_camera.iter().for_each(|(used, _)| total.extend(used));
        let cameras = rig.cameras.iter().zip(&of_camera).map(|(camera, (used, rejected))| CameraErrors {
            name: camera.name.clone(),
            errors: Errors::new(used),
            rejected: *rejected,
        });
        let mut fitting = Fitting {
            total: Errors::new(&total),
            space: SpaceErrors::new(rig, &total),
            cameras: cameras.collect(),
            findings: findings(model, rig, recording, &wrong, &medians, yardsticks),
            poor: poor(samples, &wrong, yardsticks),
        };
        if single > 0 {
            let of =
                samples.iter().flat_map(|sample| &sample.cameras).map(|one| one.pixels.len() + one.points.len()).sum();
            fitting.findings.push(Finding::Outliers { count: single, of });
        }
        fitting
    }
}

/// Samples that are used and fit poorly, by their pixels or, where there are none, their points.
fn poor(samples: &[SampleDistances], wrong: &Wrong, yardsticks: [f64; 2]) -> Vec<(usize, Distance)> {
    let of_sample = |sample: usize| {
        let cameras = || samples[sample].cameras.iter().enumerate();
        let used = |kind: Kind| cameras().filter(move |(camera, _)| !is_out(wrong, (sample, *camera, kind)));
        let mut found = Kind::ALL.into_iter().map(|kind| {
            let mut distances: Vec<f64> = used(kind).flat_map(|(_, seen)| of_kind(seen, kind)).collect();
            (kind, distances.len(), median(&mut distances))
        });
        let (kind, _, off) = found.find(|(_, count, _)| *count > 0)?;
        let yardsticks_off = off / yardsticks[kind as usize];
        (yardsticks_off > POOR).then(|| (yardsticks_off, (sample, kind.distance(off))))
    };
    let mut poor: Vec<_> = (0..samples.len()).filter_map(of_sample).collect();
    poor.sort_by(|a, b| b.0.total_cmp(&a.0));
    poor.into_iter().map(|(_, one)| one).collect()
}

fn is_out(wrong: &Wrong, image: Image) -> bool {
    wrong.moved[image.1] || wrong.joints.contains(&image.0) || wrong.images.contains(&image)
}

/// Distances of one kind.
fn of_kind(seen: &Distances, kind: Kind) -> Vec<f64> {
    match kind {
        Kind::Pixels => seen.px(),
        Kind::Points => seen.points.clone(),
    }
}

/// About the standard deviation of a coordinate of each kind: what the rig states, or the usual distance where that is larger [px, or m].
fn yardsticks(noise: &Noise, samples: &[SampleDistances], counts: impl Fn(usize, usize) -> bool) -> [f64; 2] {
    Kind::ALL.map(|kind| {
        let mut all = Vec::new();
        for (sample, of_sample) in samples.iter().enumerate() {
            let used = of_sample.cameras.iter().enumerate().filter(|(camera, _)| counts(sample, *camera));
            all.extend(used.flat_map(|(_, seen)| of_kind(seen, kind)));
        }
        let stated = if kind == Kind::Pixels { noise.pixels } else { noise.points };
        yardstick(kind, stated, &mut all)
    })
}

/// Images by their median distances [yardsticks].
fn judge(rig: &Rig, samples: &[SampleDistances], yardsticks: [f64; 2]) -> (Wrong, BTreeMap<Image, f64>) {
    let mut medians = BTreeMap::new();
    for (sample, of_sample) in samples.iter().enumerate() {
        for (camera, seen) in of_sample.cameras.iter().enumerate() {
            for kind in Kind::ALL {
                let mut distances = of_kind(seen, kind);
                if distances.len() >= IN_IMAGE {
                    medians.insert((sample, camera, kind), median(&mut distances) / yardsticks[kind as usize]);
                }
            }
        }
    }
    (wrong(&medians, 0..samples.len(), &vec![false; rig.cameras.len()]), medians)
}

fn findings(
    model: &Model,
    rig: &Rig,
    recording: &Recording,
    wrong: &Wrong,
    medians: &BTreeMap<Image, f64>,
    yardsticks: [f64; 2],
) -> Vec<Finding> {
    let off = |image: &Image| image.2.distance(medians[image] * yardsticks[image.2 as usize]);
    let index = Correspondence::new(rig, recording);
    let fits = |images: usize, read: usize| {
        let (joints, pose) = (recording.samples[read].joints.clone(), recording.samples[read].pose);
        let seen = of_sample(model, &index, &Sample { joints, pose, ..recording.samples[images].clone() });
        let still = seen.cameras.iter().enumerate().filter(|(camera, _)| !wrong.moved[*camera]);
        let over = |seen, kind: Kind| of_kind(seen, kind).into_iter().map(move |d| d / yardsticks[kind as usize]);
        fits_swapped(still.flat_map(|(_, seen)| Kind::ALL.into_iter().flat_map(move |kind| over(seen, kind))).collect())
    };
    let mut findings = Vec::new();
    for &sample in &wrong.joints {
        let images = images_of(medians, sample).filter(|(key, _)| !wrong.moved[key.1]);
        let mut images: Vec<(&Image, &f64)> = images.collect();
        images.sort_by(|a, b| a.1.total_cmp(b.1));
        let Some((usual, _)) = images.get(images.len() / 2) else { continue };
        let swapped_with = swapped_with(&wrong.joints, sample, fits);
        let by_pose = recording.samples[sample].joints.is_none();
        findings.push(Finding::WrongJoints { sample, off: off(usual), swapped_with, by_pose });
    }
    for image in &wrong.images {
        let camera = rig.cameras[image.1].name.clone();
        findings.push(Finding::WrongImage { sample: image.0, camera, off: off(image) });
    }
    for (index, camera) in rig.cameras.iter().enumerate().filter(|(index, _)| wrong.moved[*index]) {
        let images = medians.iter().filter(|(key, _)| key.1 == index && !wrong.joints.contains(&key.0));
        if let Some((worst, _)) = images.max_by(|a, b| a.1.total_cmp(b.1)) {
            findings.push(Finding::CameraMoved { camera: camera.name.clone(), largest: off(worst), sample: worst.0 });
        }
    }
    findings
}
