//! Samples that stand in for those a rig was learned from: random ones in the same ranges of the joints.
use super::{DETECTION, STAND_IN, need, ranges, stream};
use crate::Error;
use crate::reach::{Motions, Views};
use crate::recording::{RecordedCamera, Recording, Sample};
use crate::rig::{Fit, Model, Noise, Rig};
use rand::RngExt;
use std::borrow::Cow;

/// Samples at most; of more, fewer with less noise of pixels and joints tell as much.
const MOST: usize = 500;

/// What a rig was learned from.
pub(super) struct Data<'a> {
    pub recording: Cow<'a, Recording>,
    /// With those of pixels and joints lowered by the root of `thinned`.
    pub noise: Noise,
    /// Samples of the recording as a share of those that it stands for.
    pub thinned: f64,
}

/// As many samples and detections as the fit had, where the rig predicts them, with the noise that its residuals showed.
pub(super) fn stand_in(learned: &Rig, fit: &Fit, seed: u64) -> Result<Data<'static>, Error> {
    let model = Model::new(learned)?;
    let views = Views::new(learned, &model, need(learned))?;
    let is_range = |[least, most]: &[f64; 2]| least <= most && (most - least).is_finite();
    let is_known = fit.joints.len() == learned.robot.joints.len() && fit.joints.iter().all(is_range);
    let ranges = if is_known { fit.joints.clone() } else { ranges(learned, fit, false)? };
    let mut motions = Motions::new(learned, &views, ranges, stream(seed, STAND_IN));
    let samples = fit.samples.clamp(1, MOST);
    let mut recording = Recording {
        joints: learned.robot.joint_names(),
        cameras: learned.cameras.iter().map(RecordedCamera::from).collect(),
        features: learned.features.iter().map(|feature| feature.name.clone()).collect(),
        samples: Vec::new(),
    };
    for _ in 0..samples {
        let joints = motions.draw()?;
        let pixels = views.detections(&joints);
        recording.samples.push(Sample { joints: Some(joints), pixels, ..Sample::default() });
    }
    let thinned = samples as f64 / fit.samples.max(1) as f64;
    let in_view: usize = recording.samples.iter().map(|sample| sample.pixels.len()).sum();
    let detected = thinned * fit.observations as f64 / in_view.max(1) as f64;
    let mut random = stream(seed, DETECTION);
    let pixels = recording.samples.iter_mut().map(|sample| &mut sample.pixels);
    pixels.for_each(|pixels| pixels.retain(|_| random.random::<f64>() < detected));
    let mut noise = learned.noise;
    noise.pixels = noise.pixels.max(fit.rms_px / 2.0_f64.sqrt()) * thinned.sqrt();
    noise.joints *= thinned.sqrt();
    Ok(Data { recording: Cow::Owned(recording), noise, thinned })
}
