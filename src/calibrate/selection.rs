//! The noise of states picked on samples that are held out, as the paper picks λ.
use super::{Observer, Options, Progress, calibrate, evaluate, variances};
use crate::Error;
use crate::recording::Recording;
use crate::rig::{Noise, Rig};
use std::ops::ControlFlow;

/// What the stated noise of states is multiplied by, and in how many parts the samples are held out.
const FACTORS: [f64; 7] = [0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0];
const FOLDS: usize = 4;

/// How well held-out samples are predicted when states are as noisy as this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseTrial {
    /// What the noise of states was multiplied by; λ of the paper is the inverse of its square.
    pub factor: f64,
    /// The noise.
    pub noise: Noise,
    /// Mean pixel distance of the held-out samples, predicted from their readings [px]; infinite where no rig was learned.
    pub mean_px: f64,
    /// The same of points [m].
    pub mean_points_m: f64,
    /// Mean distance of all detections in standard deviations of a coordinate: what the trials are compared by.
    pub misfit: f64,
}

/// Tries several ratios of the noise of states to that of pixels, and returns how each predicts samples held out of the fit:
/// every fourth in turn. [`NoiseTrial::best`] picks one.
///
/// Errors: [`Error::Unusable`] where no state was read, so that nothing can be predicted; those of [`calibrate()`] where no
/// ratio leads to a rig.
pub fn select_noise(
    rig: &Rig,
    recording: &Recording,
    options: &Options,
    observer: Observer<'_>,
) -> Result<Vec<NoiseTrial>, Error> {
    if !recording.samples.iter().any(|sample| sample.joints.is_some() || sample.pose.is_some()) {
        return Err(Error::Unusable(
            "noise is selected by predicting samples from their readings, and the recording has actions only: estimate it \
             from the data instead"
                .into(),
        ));
    }
    let mut stated = rig.noise;
    variances::guess(&mut stated, recording);
    let options = Options { estimate_noise: false, ..options.clone() };
    let (mut trials, mut failure) = (Vec::new(), None);
    for (number, factor) in FACTORS.into_iter().enumerate() {
        let progress = Progress { stage: "noise on held-out samples", done: number, of: FACTORS.len(), rms_px: None };
        if observer(&progress) == ControlFlow::Break(()) {
            return Err(Error::Cancelled);
        }
        let noise = scaled(&stated, factor);
        let [mean_px, mean_points_m, misfit] = match held_out(&Rig { noise, ..rig.clone() }, recording, &options) {
            Ok(means) => means,
            Err(Error::NotEnoughData(reason)) => {
                failure = Some(Error::NotEnoughData(reason));
                [f64::INFINITY; 3]
            }
            Err(error) => return Err(error),
        };
        trials.push(NoiseTrial { factor, noise, mean_px, mean_points_m, misfit });
    }
    match failure {
        Some(error) if trials.iter().all(|trial| trial.misfit.is_infinite()) => Err(error),
        _ => Ok(trials),
    }
}

impl NoiseTrial {
    /// The one to take: of all that predict within 1 % of the best, which noise in the readings of held-out samples cannot tell
    /// apart, the one nearest to what was stated.
    pub fn best(trials: &[NoiseTrial]) -> Option<&NoiseTrial> {
        let least = trials.iter().map(|trial| trial.misfit).fold(f64::INFINITY, f64::min);
        let good = trials.iter().filter(|trial| trial.misfit <= 1.01 * least);
        good.min_by(|a, b| a.factor.ln().abs().total_cmp(&b.factor.ln().abs()))
    }
}

fn scaled(noise: &Noise, factor: f64) -> Noise {
    let mut scaled = *noise;
    let parts = [&mut scaled.pose, &mut scaled.pose_action].map(|pose| [&mut pose.xyz, &mut pose.rot]);
    parts.into_iter().flatten().for_each(|part| *part *= factor);
    scaled.joints *= factor;
    scaled.joint_action *= factor;
    scaled
}

/// Mean distance of all pixels [px], points [m], and both [standard deviations], each predicted by a rig learned without its sample.
fn held_out(rig: &Rig, recording: &Recording, options: &Options) -> Result<[f64; 3], Error> {
    let (mut sums, mut counts) = ([0.0; 2], [0; 2]);
    for fold in 0..FOLDS {
        let rest = recording.select(|sample| sample % FOLDS != fold);
        let learned = calibrate(rig, &rest, options, &mut |_| ControlFlow::Continue(()))?;
        let judged = evaluate(&learned.rig, &recording.select(|sample| sample % FOLDS == fold))?.total;
        let of_fold = [judged.observations - judged.points.observations, judged.points.observations];
        for (kind, mean) in [judged.mean_px, judged.points.mean_m].into_iter().enumerate() {
            sums[kind] += mean * of_fold[kind] as f64;
            counts[kind] += of_fold[kind];
        }
    }
    let mean = |kind: usize| sums[kind] / counts[kind].max(1) as f64;
    let whitened = sums[0] / rig.noise.pixels.max(1e-3) + sums[1] / rig.noise.points.max(1e-6);
    Ok([mean(0), mean(1), whitened / (counts[0] + counts[1]).max(1) as f64])
}
