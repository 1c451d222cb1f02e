//! The page of an evaluation.
use super::page::Page;
use super::residuals::of_predictions;
use super::{arm, sections};
use crate::Error;
use crate::calibrate::{CameraErrors, Evaluation};
use crate::recording::Recording;
use crate::rig::Rig;

/// A rig that was fitted well predicts what it has not seen within this many times its own residuals.
const WORSE: f64 = 1.5;

/// The page of how well a rig predicts a recording. `title` stands at the top.
///
/// Errors: [`Error::Unusable`] where rig and recording do not fit.
pub fn evaluation_html(
    title: &str,
    rig: &Rig,
    recording: &Recording,
    evaluation: &Evaluation,
) -> Result<String, Error> {
    let residuals = of_predictions(rig, recording)?;
    let mut page = Page::new(title);
    summary(&mut page, rig, evaluation);
    sections::cameras(&mut page, rig, &evaluation.cameras, &residuals);
    sections::histogram_of(&mut page, rig, &residuals);
    sections::worst(&mut page, rig, &residuals);
    sections::coverage(&mut page, rig, recording);
    arm::view(&mut page, rig, recording, arm::Shown::Few)?;
    next(&mut page, rig, evaluation);
    Ok(page.finish())
}

/// How well it predicts, beside how well it was fitted.
fn summary(page: &mut Page, rig: &Rig, evaluation: &Evaluation) {
    let Evaluation { samples, rejected, total, .. } = evaluation;
    page.section("summary", "How well it predicts");
    let mut figures = Vec::new();
    if total.observations > total.points.observations {
        figures.push((format!("{:.3} px", total.rms_px), "root mean square of the pixel distances"));
        figures.push((format!("{:.3} px", total.median_px), "median pixel distance"));
        let fitted = rig.fit.as_ref().filter(|fit| fit.rms_px > 0.0);
        figures.extend(
            fitted.map(|fit| (format!("{:.3} px", fit.rms_px), "the same root mean square when it was learned")),
        );
    }
    if total.points.observations > 0 {
        let figure = format!("{:.3} mm", 1e3 * total.points.rms_m);
        figures.push((figure, "root mean square of the distances of depth cameras' points"));
    }
    figures.extend([
        (samples.to_string(), "samples"),
        (total.observations.to_string(), "detections compared"),
        (rejected.to_string(), "detections left out"),
    ]);
    page.figures(&figures);
    if *rejected > 0 {
        page.paragraph("Left out is what the rig does not know the feature or camera of, and what has neither joints nor a tip pose.");
    }
    if total.behind > 0 {
        page.paragraph(&format!("{} detections are predicted behind their camera.", total.behind));
    }
}

/// What a reader may do.
fn next(page: &mut Page, rig: &Rig, evaluation: &Evaluation) {
    let fit = rig.fit.as_ref();
    let usual_px = fit.map(|fit| fit.rms_px).filter(|px| *px > 0.0);
    let usual_m = fit.and_then(|fit| fit.rms_points_m).filter(|m| *m > 0.0);
    let exceeds = |found: f64, usual: Option<f64>| usual.is_some_and(|usual| found > WORSE * usual);
    let is_off = |camera: &&CameraErrors| {
        exceeds(camera.errors.rms_px, usual_px) || exceeds(camera.errors.points.rms_m, usual_m)
    };
    let off: Vec<&CameraErrors> = evaluation.cameras.iter().filter(is_off).collect();
    let seeing = evaluation.cameras.iter().filter(|camera| camera.errors.observations > 0).count();
    let mut steps = Vec::new();
    if !off.is_empty() && off.len() == seeing && seeing > 1 {
        steps.push(
            "Every camera is further off than when the rig was learned: handeye monitor tells whether the base, a joint or the features \
             moved, and handeye check whether the recording is in order."
                .to_owned(),
        );
    } else {
        let words = |camera: &CameraErrors| {
            format!(
                "Camera {0} is further off than when the rig was learned: if it was moved, learn it anew with handeye calibrate --relearn \
                 cameras.{0}.",
                camera.name
            )
        };
        steps.extend(off.into_iter().map(words));
    }
    if steps.is_empty() {
        let words = if usual_px.or(usual_m).is_some() {
            "It predicts these samples about as well as those that it was learned from: nothing needs to be done."
        } else {
            "The rig does not say what it was learned from; compare the distances with the noise of the detector."
        };
        steps.push(words.to_owned());
    }
    page.section("next", "What to do next");
    page.list(&steps);
}
