//! The page of an evaluation.
use super::page::{About, Page};
use super::residuals::of_predictions;
use super::{arm, change, noise, sections};
use crate::Error;
use crate::calibrate::{CameraErrors, Evaluation, Finding, ReadingNoise, SpaceErrors, findings_in_words, over_noise};
use crate::recording::Recording;
use crate::rig::Rig;

/// A rig that was fitted well predicts what it has not seen within this many times its own residuals.
const WORSE: f64 = 1.5;

/// A camera is off only where all together are further off than this many times what they were: each has its own usual error, of which a rig
/// file does not tell.
const TOGETHER: f64 = 1.1;

/// Errors beyond this many times the stated noise are told of, though they are no misfit yet.
const TOLD: f64 = 1.5;

/// Said where a rig is judged on what it was learned from.
const OWN: &str = "The rig was learned from this recording: the figures say how well it was fitted, and not how well it predicts. Judge it on samples that it \
     has not seen.";

/// The page of how well a rig predicts a recording.
///
/// Errors: [`Error::Unusable`] where rig and recording do not fit.
pub fn evaluation_html(
    about: &About<'_>,
    rig: &Rig,
    recording: &Recording,
    evaluation: &Evaluation,
) -> Result<String, Error> {
    let residuals = of_predictions(rig, recording)?;
    let mut page = Page::new(about);
    summary(&mut page, rig, evaluation);
    sections::how_it_was_read(&mut page, about, recording);
    sections::cameras(&mut page, rig, &evaluation.cameras, &residuals);
    noise::section(&mut page, rig, &residuals, &evaluation.fitting.findings, &[]);
    sections::worst(&mut page, rig, recording, &residuals, &evaluation.fitting.findings);
    sections::coverage(&mut page, rig, recording);
    arm::view(&mut page, rig, recording, arm::Shown::Few)?;
    page.section("next", "What to do next");
    page.list(&evaluation_steps(rig, evaluation));
    Ok(page.finish())
}

/// How well it predicts, beside how well it was fitted.
fn summary(page: &mut Page, rig: &Rig, evaluation: &Evaluation) {
    let Evaluation { samples, rejected, total, space, fitting, reading_noise: (of_readings, _), .. } = evaluation;
    page.section("summary", "How well it predicts");
    let mut figures = Vec::new();
    if total.observations > total.points.observations {
        figures.push((format!("{:.3} px", total.rms_px), "root mean square of the pixel distances"));
        if !fitting.findings.is_empty() {
            figures.push((format!("{:.3} px", fitting.total.rms_px), "the same without what does not fit"));
        }
        figures.push((format!("{:.3} px", total.median_px), "median pixel distance"));
        if let Some(SpaceErrors { median_m, p95_m }) = space {
            figures.push((format!("{:.3} mm", 1e3 * median_m), "the same in space, at the depth of the features"));
            figures.push((format!("{:.3} mm", 1e3 * p95_m), "what 95 % of them do not exceed in space"));
        }
        if let Some(SpaceErrors { p95_m, .. }) = fitting.space.filter(|_| !fitting.findings.is_empty()) {
            figures.push((format!("{:.3} mm", 1e3 * p95_m), "the same 95 % without what does not fit"));
        }
        if of_readings.px > 0.0 {
            figures.push((
                format!("{:.3} px", of_readings.px),
                "root mean square that noise of what was read of the robot gives alone",
            ));
        }
        let fitted = rig.fit.as_ref().filter(|fit| fit.rms_px > 0.0);
        figures.extend(
            fitted.map(|fit| (format!("{:.3} px", fit.rms_px), "the same root mean square when it was learned")),
        );
    }
    if total.points.observations > 0 {
        let figure = format!("{:.3} mm", 1e3 * total.points.rms_m);
        figures.push((figure, "root mean square of the distances of depth cameras' points"));
        if of_readings.m > 0.0 {
            figures.push((
                format!("{:.3} mm", 1e3 * of_readings.m),
                "the same that noise of what was read of the robot gives alone",
            ));
        }
    }
    figures.extend([
        (samples.to_string(), "samples"),
        (total.observations.to_string(), "detections compared"),
        (rejected.to_string(), "detections left out"),
    ]);
    page.figures(&figures);
    if evaluation.is_own {
        page.paragraph(OWN);
    }
    if *rejected > 0 {
        page.paragraph("Left out is what the rig does not know the feature or camera of, and what does not follow from joints or a tip pose.");
    }
    page.list(&findings_in_words(&evaluation.misfits, false));
    if !fitting.findings.is_empty() {
        page.paragraph("What does not fit:");
        page.list(&findings_in_words(&fitting.findings, false));
    }
    if total.behind > 0 {
        page.paragraph(&format!("{} detections are predicted behind their camera.", total.behind));
    }
}

/// What a reader may do, in sentences; judged without what does not fit.
pub fn evaluation_steps(rig: &Rig, evaluation: &Evaluation) -> Vec<String> {
    let fitting = &evaluation.fitting;
    let fit = rig.fit.as_ref();
    let usual_px = fit.map(|fit| fit.rms_px).filter(|px| *px > 0.0);
    let usual_m = fit.and_then(|fit| fit.rms_points_m).filter(|m| *m > 0.0);
    // A fit takes the noise of readings out of its states; a prediction has it.
    let is_beyond = |found: f64, usual: Option<f64>, of_readings: f64, times: f64| {
        usual.is_some_and(|usual| found > times * usual.hypot(of_readings))
    };
    let (of_all, of_cameras) = &evaluation.reading_noise;
    let all = &fitting.total;
    let are_beyond_px = is_beyond(all.rms_px, usual_px, of_all.px, TOGETHER);
    let are_beyond_m = is_beyond(all.points.rms_m, usual_m, of_all.m, TOGETHER);
    let moved = |name: &str| {
        let is_it = |finding: &Finding| matches!(finding, Finding::CameraMoved { camera, .. } if camera == name);
        fitting.findings.iter().any(is_it)
    };
    let is_off = |(camera, of_readings): &(&CameraErrors, &ReadingNoise)| {
        let CameraErrors { name, errors, .. } = camera;
        let is_beyond_px = are_beyond_px && is_beyond(errors.rms_px, usual_px, of_readings.px, WORSE);
        moved(name) || is_beyond_px || (are_beyond_m && is_beyond(errors.points.rms_m, usual_m, of_readings.m, WORSE))
    };
    let off: Vec<&CameraErrors> =
        fitting.cameras.iter().zip(of_cameras).filter(is_off).map(|(camera, _)| camera).collect();
    let seeing = evaluation.cameras.iter().filter(|camera| camera.errors.observations > 0);
    let seeing: Vec<&str> = seeing.map(|camera| camera.name.as_str()).collect();
    let medians = evaluation.sample_median_px.iter().zip(&evaluation.sample_median_m).enumerate();
    let judged: Vec<usize> =
        medians.filter(|(_, (px, m))| px.is_some() || m.is_some()).map(|(sample, _)| sample).collect();
    let changed = change::when(&judged, &fitting.findings);
    let own = evaluation.is_own.then(|| OWN.to_owned());
    if let Some(lag) = fitting.findings.iter().find(|finding| matches!(finding, Finding::Lag { .. })) {
        return own
            .into_iter()
            .chain([format!("Mend the clocks, and judge again: {}.", lag.of_evaluation())])
            .collect();
    }
    let changes = changed.iter().map(|when| change::words(when, &seeing));
    let mut steps: Vec<String> = own.into_iter().chain(changes).collect();
    if !off.is_empty() && off.len() == seeing.len() && seeing.len() > 1 {
        steps.push(
            "Every camera is further off than when the rig was learned: `handeye monitor` tells whether the base, a joint or the features \
             moved, and `handeye check` whether the recording is in order."
                .to_owned(),
        );
    } else {
        let words = |camera: &CameraErrors| {
            format!(
                "Camera `{0}` is further off than when the rig was learned: if it was moved, learn it anew with `handeye calibrate --relearn \
                 cameras.{0}`.",
                camera.name
            )
        };
        steps.extend(off.iter().copied().map(words));
    }
    let mistakes = |finding: &Finding| {
        let is_explained = changed.is_some() && change::sample_of(finding).is_some();
        matches!(finding, Finding::WrongJoints { .. } | Finding::WrongImage { .. } | Finding::Outliers { .. })
            && !is_explained
    };
    let has_mistakes = fitting.findings.iter().any(mistakes);
    // Where something moved, that is the reason.
    let misfits = if off.is_empty() && changed.is_none() { &evaluation.misfits[..] } else { &[] };
    if steps.is_empty() {
        let besides = if has_mistakes { "Without what does not fit, it" } else { "It" };
        steps.push(if usual_px.or(usual_m).is_some() {
            let noise =
                if of_all.px > 0.0 || of_all.m > 0.0 { " but for the noise of what was read of the robot" } else { "" };
            let verdict =
                if misfits.is_empty() { in_noise(rig, evaluation) } else { ", and both too badly.".to_owned() };
            format!("{besides} predicts these samples about as well as those that it was learned from{noise}{verdict}")
        } else {
            "The rig does not say what it was learned from; compare the distances with the noise of the detector."
                .to_owned()
        });
    }
    let reason = |misfit: &Finding| {
        format!(
            "Find the reason before the rig is relied on: {}. Learn again with the numbers free that `[estimate]` holds, or with `--estimate-noise`, \
             and see whether the errors fall.",
            misfit.of_evaluation()
        )
    };
    steps.extend(misfits.iter().map(reason));
    if has_mistakes {
        steps.push(
            "The samples, images and detections that are named as not fitting are far off while the rest fits: they are mistakes of the \
             recording rather than of the rig. Look at these images; the figures without them are those of the rig."
                .to_owned(),
        );
    }
    steps
}

/// What errors mean that are no larger than they were, in relation to the stated noise.
fn in_noise(rig: &Rig, evaluation: &Evaluation) -> String {
    let ratios = over_noise(&rig.noise, &evaluation.fitting.total, &evaluation.reading_noise.0);
    match ratios.into_iter().max_by(|one, other| one.0.total_cmp(&other.0)) {
        Some((ratio, stated)) if ratio > TOLD => format!(
            ", with errors {ratio:.1} times the stated noise of {}: nothing has moved, and the noise is larger than stated or the rig leaves \
             something out.",
            stated.rounded()
        ),
        _ => ": nothing needs to be done.".to_owned(),
    }
}
