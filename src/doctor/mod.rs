//! Looks for mistakes in a recording before it is learned from: each as an alternative, scored against the data as recorded.
mod alternatives;
mod data;

use crate::Error;
use crate::calibrate::{self, Finding as Misfit, calibrate, evaluate};
use crate::recording::Recording;
use crate::rig::Rig;
use std::ops::ControlFlow;

/// An alternative is a finding where its score is below this share of the score as recorded.
const CLEARLY_BETTER: f64 = 0.5;

/// One hypothesis of how the data came about and how well it explains them.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The hypothesis, in words.
    pub alternative: &'static str,
    /// Median pixel distance of all detections under the rig learned from it [px]; `None` where no rig could be learned.
    pub median_px: Option<f64>,
}

/// A mistake in the data, or something that they lack.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What is wrong.
    pub what: String,
    /// What to change.
    pub change: String,
}

/// What was found, and the scores that say so; the first is of the data as recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagnosis {
    /// One per hypothesis that was tested.
    pub scores: Vec<Score>,
    /// Empty where nothing is wrong.
    pub findings: Vec<Finding>,
}

/// Examines a recording with joints and pixels: units, pairing, image axes, principal points, repeated samples.
///
/// A whole calibration is made per alternative. Errors: [`Error::Unusable`] where rig and recording do not go together.
pub fn examine(rig: &Rig, recording: &Recording, options: &calibrate::Options) -> Result<Diagnosis, Error> {
    let mut diagnosis = Diagnosis { findings: data::findings(recording), ..Diagnosis::default() };
    if !recording.samples.iter().any(|sample| sample.joints.is_some() && !sample.pixels.is_empty()) {
        return Ok(diagnosis);
    }
    let (as_recorded, misfits) = score(rig, recording, options)?;
    diagnosis.scores.push(Score { alternative: "as recorded", median_px: as_recorded });
    for misfit in &misfits {
        if let Misfit::WrongJoints { sample, swapped_with: Some(other), .. } = misfit
            && sample < other
        {
            diagnosis.findings.push(Finding {
                what: format!("the joint rows of samples {sample} and {other} are swapped"),
                change: "exchange the joints of the two samples".to_owned(),
            });
        }
    }
    let mut best: Option<(f64, alternatives::Alternative)> = None;
    for alternative in alternatives::all(rig, recording) {
        let (median_px, _) = score(&alternative.rig, &alternative.recording, options)?;
        diagnosis.scores.push(Score { alternative: alternative.name, median_px });
        let limit = best.as_ref().map_or(CLEARLY_BETTER * as_recorded.unwrap_or(f64::INFINITY), |best| best.0);
        if let Some(found) = median_px.filter(|found| *found < limit) {
            best = Some((found, alternative));
        }
    }
    if let Some((_, alternative)) = best {
        let (what, change) = (alternative.name.to_owned(), alternative.change.to_owned());
        diagnosis.findings.push(Finding { what, change });
    }
    Ok(diagnosis)
}

/// How well a rig learned from the recording explains all of it, and what does not fit.
fn score(rig: &Rig, recording: &Recording, options: &calibrate::Options) -> Result<(Option<f64>, Vec<Misfit>), Error> {
    match calibrate(rig, recording, options, &mut |_| ControlFlow::Continue(())) {
        Ok(learned) => {
            let median_px = evaluate(&learned.rig, recording).ok().map(|judged| judged.total.median_px);
            Ok((median_px.filter(|median| median.is_finite()), learned.report.findings))
        }
        Err(error) if error.is_input() => Err(error),
        Err(_) => Ok((None, Vec::new())),
    }
}
