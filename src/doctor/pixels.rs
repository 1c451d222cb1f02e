//! Which reading of joints or tip poses explains the pixels and points: a calibration per alternative.
use super::alternatives::{self, Alternative};
use super::images::{self, Axes};
use super::lag::lag;
use super::thin::{thin, thinned, with_fewer_features};
use super::{About, Diagnosis, Finding, Misfit, Score, Watch, is_clearly_better};
use crate::Error;
use crate::calibrate::{
    self, Calibration, Finding as Unfit, Motion, ReadingNoise, calibrate, lag_in_words, usual_distance,
};
use crate::recording::Recording;
use crate::rig::{Model, Noise, Rig};
use std::ops::ControlFlow;

/// An alternative fits in itself where its misfit is below this many times what noise leaves.
const FITS: f64 = 5.0;

/// Most iterations of each fit under an alternative: where it is right a few are enough, and where it is not they would go on creeping.
const ITERATIONS: usize = 50;

/// A lag is told from a shift by whole samples where its misfit is below this share of the shift's.
const FINER: f64 = 0.8;

/// Adds scores and findings.
pub(super) fn examine(
    rig: &Rig,
    whole: &Recording,
    options: &calibrate::Options,
    diagnosis: &mut Diagnosis,
    watch: &mut Watch<'_>,
) {
    let kept = thin(whole);
    let recording = &whole.select(|index| kept.binary_search(&index).is_ok());
    diagnosis.thinned_to = (kept.len() < whole.samples.len()).then_some(kept.len());
    let axes = images::axes(rig, recording);
    let (axes_name, axes_change) = ("u and v are swapped", "write pixels as [u, v]: u to the right, v down");
    if axes == Axes::Swapped {
        diagnosis.findings.push(finding(axes_name, axes_change));
        return;
    }
    let (as_recorded, learned, found) = match learn(rig, recording, options, "as recorded", watch) {
        Ok(learned) => {
            diagnosis.noise = with_readings(&learned.rig, recording);
            (misfit(&learned.rig, recording), Some(learned.rig), learned.report.findings)
        }
        Err(error) => {
            diagnosis.unsolved = Some(error.to_string());
            if error.is_input() {
                return;
            }
            (None, None, Vec::new())
        }
    };
    diagnosis.scores.push(Score { alternative: "as recorded".into(), misfit: as_recorded });
    let noise = diagnosis.noise;
    let options = &calibrate::Options { iterations: options.iterations.min(ITERATIONS), ..options.clone() };

    // What free intrinsics can hide shows where they are held.
    let held = images::held(rig, recording);
    let is_held = held.estimate != rig.estimate;
    let mut reference = None;
    let mut hidden: Vec<Alternative> = Vec::new();
    let suspects = images::suspects(rig, recording);
    if !suspects.is_empty() {
        let (rig, recording) = images::exchanged_centres(&held, recording, &suspects);
        let name = format!("the principal point of {} has its coordinates swapped", suspects.join(", "));
        hidden.push(Alternative { about: About::Order, name, change: "exchange cx and cy".into(), rig, recording });
    }
    if axes == Axes::Open && is_held {
        let (name, change) = (axes_name.into(), axes_change.into());
        let recording = images::exchanged_axes(recording);
        hidden.push(Alternative { about: About::Order, name, change, rig: held.clone(), recording });
    }
    let mut best: Option<(Misfit, Finding)> = None;
    for alternative in hidden {
        let misfit = score(&alternative.rig, &alternative.recording, options, &alternative.name, watch);
        let reference = *reference.get_or_insert_with(|| {
            if is_held { score(&held, recording, options, "as recorded", watch) } else { as_recorded }
        });
        consider(alternative, misfit, reference, &noise, &mut best, diagnosis);
    }
    let explains = |misfit: &Misfit| misfit.is_explained(&noise);
    let is_fine = |best: &Option<(Misfit, Finding)>| best.as_ref().is_some_and(|(misfit, _)| explains(misfit));
    if !is_fine(&best) && !as_recorded.as_ref().is_some_and(explains) {
        for alternative in alternatives::all(rig, whole) {
            let recording = thinned(&alternative.recording);
            let misfit = score(&alternative.rig, &recording, options, &alternative.name, watch);
            consider(alternative, misfit, as_recorded, &noise, &mut best, diagnosis);
            if is_fine(&best) {
                break;
            }
        }
    }
    let motion = Motion::new(whole).zip(learned.as_ref()).filter(|(motion, learned)| {
        !is_fine(&best) && (!as_recorded.as_ref().is_some_and(explains) || motion.shows_lag(learned))
    });
    if let Some(lag) = motion.and_then(|(motion, learned)| lag(&motion, rig, learned, options, watch)) {
        let misfit = score(rig, &lag.recording, options, "a lag", watch);
        let Finding { what, .. } = of_lag(lag.seconds);
        diagnosis.scores.push(Score { alternative: what.clone(), misfit });
        let [as_it_moves, without] = lag.misfits;
        diagnosis.scores.push(Score { alternative: "as recorded, where it moves fastest".into(), misfit: as_it_moves });
        diagnosis.scores.push(Score { alternative: format!("{what}, where it moves fastest"), misfit: without });
        let beaten = best.as_ref().map(|(best, _)| FINER * best.size());
        let is_lag = is_clearly_better(without, as_it_moves);
        if let Some(misfit) = misfit.filter(|misfit| is_lag || is_right(About::Order, *misfit, as_recorded, &noise))
            && beaten.is_none_or(|beaten| misfit.size() < beaten)
        {
            best = Some((misfit, of_lag(lag.seconds)));
        }
    }
    match best {
        Some((_, finding)) => diagnosis.findings.push(finding),
        // Single rows are judged by a fit, which says nothing where all of the data are wrong.
        None => diagnosis.findings.extend(found.iter().filter_map(|unfit| swapped(unfit, &kept))),
    }
}

fn consider(
    alternative: Alternative,
    misfit: Option<Misfit>,
    reference: Option<Misfit>,
    noise: &Noise,
    best: &mut Option<(Misfit, Finding)>,
    diagnosis: &mut Diagnosis,
) {
    let Alternative { about, name, change, .. } = alternative;
    diagnosis.scores.push(Score { alternative: name.clone(), misfit });
    if let Some(misfit) = misfit.filter(|misfit| is_right(about, *misfit, reference, noise))
        && best.as_ref().is_none_or(|(best, _)| misfit.size() < best.size())
    {
        *best = Some((misfit, Finding { about, what: name, change }));
    }
}

/// Where nothing is learned as recorded there is nothing to be better than, and an order of joints undoes part of many others: these have to fit in
/// themselves.
fn is_right(about: About, misfit: Misfit, reference: Option<Misfit>, noise: &Noise) -> bool {
    let fits = || misfit.over_noise(noise).is_none_or(|over_noise| over_noise < FITS);
    is_clearly_better(Some(misfit), reference) && ((reference.is_some() && about != About::Joints) || fits())
}

/// Rows of joints or tip poses that the calibration itself found to be exchanged; `kept`: indices of the samples that it saw.
fn swapped(unfit: &Unfit, kept: &[usize]) -> Option<Finding> {
    let Unfit::WrongJoints { sample, swapped_with: Some(other), by_pose, .. } = unfit else { return None };
    let (rows, read) = if *by_pose { ("robot poses", "robot poses") } else { ("joint rows", "joints") };
    let [sample, other] = [kept.get(*sample)?, kept.get(*other)?];
    (sample < other).then(|| {
        let what = format!("the {rows} of samples {sample} and {other} are swapped");
        finding(&what, &format!("exchange the {read} of the two samples"))
    })
}

/// `seconds`: by how much joints are stamped late.
fn of_lag(seconds: f64) -> Finding {
    let [what, change] = lag_in_words(seconds);
    finding(&what, &change)
}

fn finding(what: &str, change: &str) -> Finding {
    Finding { about: About::Order, what: what.to_owned(), change: change.to_owned() }
}

/// Calibrates under a hypothesis.
pub(super) fn learn(
    rig: &Rig,
    recording: &Recording,
    options: &calibrate::Options,
    hypothesis: &str,
    watch: &mut Watch<'_>,
) -> Result<Calibration, Error> {
    calibrate(rig, recording, options, &mut |progress| {
        watch(hypothesis, progress);
        ControlFlow::Continue(())
    })
}

/// How well a rig that is learned under a hypothesis explains the recording, by some of its features.
fn score(
    rig: &Rig,
    recording: &Recording,
    options: &calibrate::Options,
    hypothesis: &str,
    watch: &mut Watch<'_>,
) -> Option<Misfit> {
    let (rig, recording) = with_fewer_features(rig, recording);
    misfit(&learn(&rig, &recording, options, hypothesis, watch).ok()?.rig, &recording)
}

/// How well a learned rig explains all of a recording.
fn misfit(rig: &Rig, recording: &Recording) -> Option<Misfit> {
    usual_distance(rig, recording).map(Misfit::from)
}

/// A rig's noise of a coordinate of pixels and points, with what noise of the readings moves them by.
fn with_readings(rig: &Rig, recording: &Recording) -> Noise {
    let of_readings = Model::new(rig).map(|model| ReadingNoise::new(rig, &model, recording).0).unwrap_or_default();
    Noise {
        pixels: rig.noise.pixels.hypot(of_readings.px / 2.0_f64.sqrt()),
        points: rig.noise.points.hypot(of_readings.m / 3.0_f64.sqrt()),
        ..rig.noise
    }
}
