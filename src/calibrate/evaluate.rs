//! Predicts the pixels of a recording and compares.
use crate::Error;
use crate::recording::{Recording, Sample};
use crate::rig::{Model, Rig};

/// Pixel distances between what a rig predicts and what was seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// How many detections were compared.
    pub observations: usize,
    /// Root mean square [px]; 0 where there is none.
    pub rms_px: f64,
    /// Mean [px].
    pub mean_px: f64,
    /// Median [px].
    pub median_px: f64,
    /// Largest [px].
    pub max_px: f64,
    /// How many are predicted behind the camera.
    pub behind: usize,
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
    /// Detections left out because the rig does not know their camera or feature, or because their sample has neither joints nor a tip pose.
    pub rejected: usize,
    /// Over all cameras.
    pub total: Errors,
    /// Per camera of the rig, in its order.
    pub cameras: Vec<CameraErrors>,
    /// Median pixel distance of every sample [px], where anything was compared in it.
    pub sample_median_px: Vec<Option<f64>>,
}

/// Predicts every pixel of a recording from its joints, or from its tip's pose where it has none, and compares.
///
/// Fails with [`Error::Unusable`] where the rig is not complete or has another number of joints.
pub fn evaluate(rig: &Rig, recording: &Recording) -> Result<Evaluation, Error> {
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
    let mut distances: Vec<Vec<(f64, bool)>> = vec![Vec::new(); rig.cameras.len()];
    let mut evaluation = Evaluation::default();
    for sample in &recording.samples {
        let mut of_sample = Vec::new();
        for (camera, distance, behind) in sample_errors(&model, &index, sample) {
            of_sample.push(distance);
            distances[camera].push((distance, behind));
        }
        evaluation.rejected += sample.pixels.len() - of_sample.len();
        evaluation.samples += usize::from(!of_sample.is_empty());
        evaluation.sample_median_px.push((!of_sample.is_empty()).then(|| median(&mut of_sample)));
    }
    evaluation.total = Errors::new(&distances.concat());
    evaluation.cameras = rig
        .cameras
        .iter()
        .zip(&distances)
        .map(|(camera, distances)| CameraErrors {
            name: camera.name.clone(),
            errors: Errors::new(distances),
            rejected: 0,
        })
        .collect();
    if evaluation.total.observations == 0 {
        return Err(Error::NotEnoughData(
            "nothing to compare: no sample has joints, or a tip pose, and a detection of a feature that the rig knows"
                .into(),
        ));
    }
    Ok(evaluation)
}

/// (camera, pixel distance, whether predicted behind) of every detection of a sample that can be predicted.
fn sample_errors<'a>(
    model: &'a Model,
    index: &'a Correspondence,
    sample: &'a Sample,
) -> impl Iterator<Item = (usize, f64, bool)> + 'a {
    let from_pose = || sample.pose.map(|tip| vec![model.base, tip]);
    let links = sample.joints.as_ref().map(|joints| model.links(joints)).or_else(from_pose);
    sample.pixels.iter().filter_map(move |detection| {
        let links = links.as_ref()?;
        let camera = index.cameras[detection.camera as usize]?;
        let feature = index.features[detection.feature as usize]?;
        let [u, v] = model.pixel(camera, feature, links);
        let point = model.in_camera(camera, feature, links);
        let behind = !model.cameras[camera].model.is_in_front(&point);
        Some((camera, (u - detection.pixel[0]).hypot(v - detection.pixel[1]), behind))
    })
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

impl Errors {
    /// Of pixel distances, each with whether it was predicted behind the camera.
    pub fn new(distances: &[(f64, bool)]) -> Self {
        let n = distances.len();
        if n == 0 {
            return Errors::default();
        }
        let mut sorted: Vec<f64> = distances.iter().map(|(distance, _)| *distance).collect();
        let median_px = median(&mut sorted);
        Errors {
            observations: n,
            rms_px: (sorted.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt(),
            mean_px: sorted.iter().sum::<f64>() / n as f64,
            median_px,
            max_px: sorted[n - 1],
            behind: distances.iter().filter(|(_, behind)| *behind).count(),
        }
    }
}

/// Sorts, and returns the middle: the mean of the two middle ones of an even number.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { 0.0 } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}
