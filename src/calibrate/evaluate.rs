//! Predicts the detections of a recording and compares.
use super::lag;
use super::misfit::misfits;
use super::observation::Kind;
use super::placed::Placed;
use super::{Finding, Fitting, ReadingNoise};
use crate::Error;
use crate::recording::{Recording, Sample};
use crate::rig::{Camera, Fit, Model, ModelCamera, Rig};
use nalgebra::Vector3;

/// Distances between what a rig predicts and what was seen. Those in px are of pixels, and 0 where there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// How many detections were compared, pixels and points.
    pub observations: usize,
    /// Root mean square [px].
    pub rms_px: f64,
    /// Mean [px].
    pub mean_px: f64,
    /// Median [px].
    pub median_px: f64,
    /// Largest [px].
    pub max_px: f64,
    /// How many are predicted behind the camera.
    pub behind: usize,
    /// Of points that depth cameras saw.
    pub points: PointErrors,
}

/// Distances between predicted and seen points of depth cameras; 0 where there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointErrors {
    /// How many points were compared.
    pub observations: usize,
    /// Root mean square [m].
    pub rms_m: f64,
    /// Mean [m].
    pub mean_m: f64,
    /// Median [m].
    pub median_m: f64,
    /// Largest [m].
    pub max_m: f64,
}

/// Pixel distances as lengths in space, at the depth of each feature: distance × depth / focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpaceErrors {
    /// Median [m].
    pub median_m: f64,
    /// What 95 % of them do not exceed [m].
    pub p95_m: f64,
}

/// Errors of one camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraErrors {
    /// Its name.
    pub name: String,
    /// Its errors.
    pub errors: Errors,
    /// Detections that were left out as wrong.
    pub rejected: usize,
}

/// How well a rig predicts a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evaluation {
    /// Samples with joints or a tip pose, and at least one comparable detection.
    pub samples: usize,
    /// Detections left out because the rig does not know their camera or feature, or because their sample has neither joints nor a tip pose
    /// from which they follow.
    pub rejected: usize,
    /// Over all cameras.
    pub total: Errors,
    /// The pixel distances as lengths; `None` where those of the rig are no metres, or no feature is predicted in front of a camera.
    pub space: Option<SpaceErrors>,
    /// True where this is what the rig was learned from, as far as its `[fit]` tells: it has as many detections, and the readings of the joints
    /// that `[fit]` names as least and largest.
    pub is_own: bool,
    /// Per camera of the rig, in its order.
    pub cameras: Vec<CameraErrors>,
    /// Median pixel distance of every sample [px], where anything was compared in it.
    pub sample_median_px: Vec<Option<f64>>,
    /// Median distance of the points of every sample [m], where any were compared in it.
    pub sample_median_m: Vec<Option<f64>>,
    /// The same errors without the images, samples and detections that do not fit, and which these are.
    pub fitting: Fitting,
    /// What noise of the readings alone gives such errors, over all cameras and per camera of the rig.
    pub reading_noise: (ReadingNoise, Vec<ReadingNoise>),
    /// [`Finding::Misfit`] where the errors, without what does not fit, are far larger than the stated noise and that of readings, as a calibration
    /// has it.
    pub misfits: Vec<Finding>,
}

/// Distances of single detections from where they are predicted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distances {
    /// Of pixels.
    pub pixels: Vec<PixelDistance>,
    /// Of points [m].
    pub points: Vec<f64>,
}

/// Distance of one pixel from where it is predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelDistance {
    /// In the image [px].
    pub px: f64,
    /// In space, at the depth of the feature [m, or the rig's unit]; `None` where that is predicted behind the camera.
    pub in_space: Option<f64>,
}

/// Predicts every detection of a recording from its joints, or from its tip's pose where it has none, and compares.
///
/// Fails with [`Error::Unusable`] where the rig is not complete or has another number of joints.
pub fn evaluate(rig: &Rig, recording: &Recording) -> Result<Evaluation, Error> {
    let mut of_camera = vec![Distances::default(); rig.cameras.len()];
    let mut evaluation = Evaluation::default();
    let samples = distances(rig, recording)?;
    for of_sample in &samples {
        let mut all = Distances::default();
        for (camera, distances) in of_camera.iter_mut().zip(&of_sample.cameras) {
            camera.extend(distances);
            all.extend(distances);
        }
        evaluation.rejected += of_sample.rejected;
        evaluation.samples += usize::from(!all.is_empty());
        let mut pixels = all.px();
        evaluation.sample_median_px.push((!pixels.is_empty()).then(|| median(&mut pixels)));
        evaluation.sample_median_m.push((!all.points.is_empty()).then(|| median(&mut all.points)));
    }
    let mut total = Distances::default();
    of_camera.iter().for_each(|distances| total.extend(distances));
    if total.is_empty() {
        return Err(Error::NotEnoughData(
            "nothing to compare: no sample has joints, or a tip pose, and a detection of a feature that the rig knows"
                .into(),
        ));
    }
    evaluation.total = Errors::new(&total);
    evaluation.space = SpaceErrors::new(rig, &total);
    evaluation.is_own = rig.fit.as_ref().is_some_and(|fit| is_learned_from(fit, recording));
    let errors = |(camera, distances): (&Camera, &Distances)| CameraErrors {
        name: camera.name.clone(),
        errors: Errors::new(distances),
        rejected: 0,
    };
    evaluation.cameras = rig.cameras.iter().zip(&of_camera).map(errors).collect();
    let model = Model::new(rig)?;
    evaluation.fitting = Fitting::new(rig, &model, recording, &samples);
    evaluation.reading_noise = ReadingNoise::new(rig, &model, recording);
    evaluation.misfits = misfits(&rig.noise, &evaluation.fitting.total, &evaluation.reading_noise.0);
    let found = [&evaluation.fitting.findings[..], &evaluation.misfits].concat();
    evaluation.fitting.findings.splice(..0, lag::behind(&found, rig, recording));
    Ok(evaluation)
}

/// Whether a rig was learned from a recording. Readings are compared exactly: two recordings hardly share all of their extremes.
fn is_learned_from(fit: &Fit, recording: &Recording) -> bool {
    let samples = &recording.samples;
    let detections: usize = samples.iter().map(|sample| sample.pixels.len() + sample.points.len()).sum();
    let is_read = |joint: usize, extreme: f64| {
        samples.iter().filter_map(|sample| sample.joints.as_ref()?.get(joint)).any(|reading| *reading == extreme)
    };
    let mut extremes = fit.joints.iter().enumerate().flat_map(|(joint, range)| range.map(|extreme| (joint, extreme)));
    !fit.joints.is_empty()
        && detections == fit.observations + fit.rejected
        && extremes.all(|(joint, extreme)| is_read(joint, extreme))
}

/// What of one sample could be compared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleDistances {
    /// Per camera of the rig, in its order.
    pub cameras: Vec<Distances>,
    /// How many detections cannot be predicted.
    pub rejected: usize,
}

/// Distances of every detection of every sample.
///
/// Errors: as of [`evaluate()`], but that nothing at all may be compared.
pub fn distances(rig: &Rig, recording: &Recording) -> Result<Vec<SampleDistances>, Error> {
    let model = Model::new(rig)?;
    let has_joints = recording.samples.iter().any(|sample| sample.joints.is_some());
    if has_joints && model.chain.len() != recording.joints.len() {
        return Err(Error::Unusable(format!(
            "the rig has {} joints, the recording {}",
            model.chain.len(),
            recording.joints.len()
        )));
    }
    let index = Correspondence::new(rig, recording);
    Ok(recording.samples.iter().map(|sample| of_sample(&model, &index, sample)).collect())
}

pub(crate) fn of_sample(model: &Model, index: &Correspondence, sample: &Sample) -> SampleDistances {
    let mut cameras = vec![Distances::default(); model.cameras.len()];
    let placed = Placed::read(model, sample);
    let predictable = placed.as_ref().map(|placed| (placed, placed.predictable(model, index, sample)));
    let mut n_predicted = 0;
    if let Some((Placed { links, .. }, predictable)) = predictable {
        n_predicted = predictable.len();
        for seen in predictable {
            let of_camera = &mut cameras[seen.camera];
            let distance = seen.error(model, links).norm();
            match seen.kind() {
                Kind::Pixels => {
                    let point = model.in_camera(seen.camera, seen.feature, links);
                    of_camera.pixels.push(PixelDistance::new(distance, &model.cameras[seen.camera], &point));
                }
                Kind::Points => of_camera.points.push(distance),
            }
        }
    }
    SampleDistances { cameras, rejected: sample.pixels.len() + sample.points.len() - n_predicted }
}

/// Which camera and feature of a rig each of a recording's is, by name.
pub(crate) struct Correspondence {
    pub cameras: Vec<Option<usize>>,
    pub features: Vec<Option<usize>>,
}

impl Correspondence {
    pub fn new(rig: &Rig, recording: &Recording) -> Self {
        let camera = |name: &str| rig.cameras.iter().position(|camera| camera.name == name);
        let names: std::collections::BTreeMap<&str, usize> =
            rig.features.iter().enumerate().map(|(index, feature)| (feature.name.as_str(), index)).collect();
        Correspondence {
            cameras: recording.cameras.iter().map(|recorded| camera(&recorded.name)).collect(),
            features: recording.features.iter().map(|name| names.get(name.as_str()).copied()).collect(),
        }
    }
}

impl Distances {
    /// Adds others.
    pub fn extend(&mut self, others: &Distances) {
        self.pixels.extend(&others.pixels);
        self.points.extend(&others.points);
    }

    /// Those of pixels [px].
    pub(crate) fn px(&self) -> Vec<f64> {
        self.pixels.iter().map(|pixel| pixel.px).collect()
    }

    /// True where there is neither a pixel nor a point.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty() && self.points.is_empty()
    }
}

impl Errors {
    /// Of single distances.
    pub fn new(distances: &Distances) -> Self {
        let mut pixels = distances.px();
        let [rms_px, mean_px, median_px, max_px] = summary(&mut pixels);
        let mut points = distances.points.clone();
        let [rms_m, mean_m, median_m, max_m] = summary(&mut points);
        Errors {
            observations: pixels.len() + points.len(),
            rms_px,
            mean_px,
            median_px,
            max_px,
            behind: distances.pixels.iter().filter(|pixel| pixel.in_space.is_none()).count(),
            points: PointErrors { observations: points.len(), rms_m, mean_m, median_m, max_m },
        }
    }
}

impl PixelDistance {
    /// Of a feature that is predicted at a point of the camera's frame [m].
    pub(crate) fn new(px: f64, camera: &ModelCamera, point: &Vector3<f64>) -> Self {
        PixelDistance { px, in_space: camera.length_per_pixel(point).map(|per_pixel| px * per_pixel) }
    }
}

impl SpaceErrors {
    /// `None` of nothing, and where the lengths of the rig are no metres.
    pub(crate) fn new(rig: &Rig, distances: &Distances) -> Option<Self> {
        if rig.fit.as_ref().is_some_and(|fit| fit.unit().is_some()) {
            return None;
        }
        let mut lengths: Vec<f64> = distances.pixels.iter().filter_map(|pixel| pixel.in_space).collect();
        let median_m = median(&mut lengths);
        let most = (0.95 * lengths.len() as f64).ceil() as usize;
        lengths.get(most.checked_sub(1)?).map(|&p95_m| SpaceErrors { median_m, p95_m })
    }
}

/// Root mean square, mean, median and largest; 0 of nothing.
fn summary(values: &mut [f64]) -> [f64; 4] {
    if values.is_empty() {
        return [0.0; 4];
    }
    let n = values.len() as f64;
    let median = median(values);
    let rms = (values.iter().map(|d| d * d).sum::<f64>() / n).sqrt();
    [rms, values.iter().sum::<f64>() / n, median, values.last().copied().unwrap_or(0.0)]
}

/// Sorts, and returns the middle: the mean of the two middle ones of an even number.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { 0.0 } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}
