//! A lag between the clocks of robot and images under which a rig fits, where samples are dense enough to interpolate joints between them.
//!
//! What stands still looks the same at any lag, and may be most of a recording. So a lag is judged by the samples in which the robot is fastest.
use super::evaluate::{distances, median};
use super::{Distance, Distances, Finding};
use crate::recording::{Readings, Recording, Sample};
use crate::rig::Rig;

/// Lags are tried up to so many sample periods, in steps of so much of one; around the best of them in finer ones.
const PERIODS: f64 = 5.0;
const STEP: f64 = 0.1;
const FINER_STEP: f64 = 0.01;

/// A lag is judged by this share of the samples: those in which the robot is fastest.
const FASTEST: f64 = 1.0 / 3.0;

/// So many of them at most are looked at, spread evenly.
const MOST: usize = 100;

/// A mistake is named where the misfit without it is below this share of that with it.
pub(crate) const CLEARLY_BETTER: f64 = 0.5;

/// Two lags that are nearer than this are the same: one and a half of the finer steps [sample periods].
pub(crate) const SAME: f64 = 1.5 * FINER_STEP;

/// The lag behind what does not fit a rig, where there is one; `None` where nothing was found that a lag would explain.
pub(super) fn behind(findings: &[Finding], rig: &Rig, recording: &Recording) -> Option<Finding> {
    let may_be = |finding: &Finding| {
        matches!(
            finding,
            Finding::Misfit { .. }
                | Finding::WrongJoints { .. }
                | Finding::WrongImage { .. }
                | Finding::CameraMoved { .. }
        )
    };
    if !findings.iter().any(may_be) {
        return None;
    }
    let motion = Motion::new(recording)?;
    let seconds = motion.best_lag(rig)?;
    let misfits = [motion.misfit(rig, 0.0)?, motion.misfit(rig, seconds)?];
    is_clearly_better(misfits).then_some(Finding::Lag { seconds, misfits })
}

/// What is wrong with stamps of joints that are late by so much [s], and what to change.
pub(crate) fn in_words(seconds: f64) -> [String; 2] {
    let by = seconds.abs();
    let (side, to) = if seconds > 0.0 { ("late", "subtract") } else { ("early", "add") };
    let stamps = if seconds > 0.0 { "from the stamps" } else { "to the stamps" };
    // A sum with zero is never negative zero.
    let delay = format!("`--joint-delay {:.3}`", 0.0 - seconds);
    [
        format!("joints are stamped {by:.3} s too {side}"),
        format!("{to} {by:.3} s {stamps} of the joints, as {delay} does"),
    ]
}

fn is_clearly_better([with, without]: [Distance; 2]) -> bool {
    without.size() < CLEARLY_BETTER * with.size()
}

/// The median distance of all that a recording shows from where a rig predicts it: of pixels, or of points where they are more. `None` where nothing
/// can be compared.
pub(crate) fn usual_distance(rig: &Rig, recording: &Recording) -> Option<Distance> {
    let mut all = Distances::default();
    for of_sample in distances(rig, recording).ok()? {
        of_sample.cameras.iter().for_each(|seen| all.extend(seen));
    }
    let (mut px, mut m) = (all.px(), all.points);
    let distance =
        if px.len() > m.len() { Distance::Pixels(median(&mut px)) } else { Distance::Metres(median(&mut m)) };
    (px.len() + m.len() > 0 && distance.size().is_finite()).then_some(distance)
}

/// A recording that is dense in time.
pub(crate) struct Motion<'a> {
    pub recording: &'a Recording,
    /// Median time between samples [s].
    pub period: f64,
    /// Some of the samples in which the robot is fastest.
    fastest: Recording,
}

impl<'a> Motion<'a> {
    /// `None` where samples are not dense in time.
    pub fn new(recording: &'a Recording) -> Option<Self> {
        let period = recording.dense_period()?;
        let fastest = fastest(recording)?;
        Some(Motion { recording, period, fastest })
    }

    /// True where some lag explains the fastest samples clearly better, under a rig that was learned from what was recorded.
    pub fn shows_lag(&self, learned: &Rig) -> bool {
        let misfit = |lag: f64| self.misfit(learned, lag);
        let best = self.best_lag(learned).and_then(misfit);
        misfit(0.0).zip(best).is_some_and(|(with, without)| is_clearly_better([with, without]))
    }

    /// Of the fastest samples, with joints that were stamped `lag` [s] later.
    pub fn misfit(&self, rig: &Rig, lag: f64) -> Option<Distance> {
        usual_distance(rig, &interpolated(self.recording, &self.fastest, lag))
    }

    /// Of several that are as good the smallest.
    pub fn best_lag(&self, rig: &Rig) -> Option<f64> {
        let best_of = |around: f64, step: f64, n_steps: i32| {
            let lags = (-n_steps..=n_steps).map(|k| around + f64::from(k) * step * self.period);
            let sizes = lags.map(|lag| (self.misfit(rig, lag).map_or(f64::INFINITY, |misfit| misfit.size()), lag));
            sizes.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.abs().total_cmp(&b.1.abs()))).map(|(_, lag)| lag)
        };
        let coarse = best_of(0.0, STEP, (PERIODS / STEP).round() as i32)?;
        best_of(coarse, FINER_STEP, (STEP / FINER_STEP).round() as i32)
    }
}

/// The samples in which joints go fastest, from the sample before to the one after.
fn fastest(recording: &Recording) -> Option<Recording> {
    let samples = &recording.samples;
    let speed = |index: usize| -> Option<f64> {
        let [before, after] = [samples.get(index.checked_sub(1)?)?, samples.get(index + 1)?];
        let (from, to) = (before.joints.as_ref()?, after.joints.as_ref()?);
        let way: f64 = from.iter().zip(to).map(|(from, to)| (to - from).powi(2)).sum();
        let seconds = after.time? - before.time?;
        (seconds > 0.0).then(|| way.sqrt() / seconds)
    };
    let mut by_speed: Vec<(f64, usize)> =
        (0..samples.len()).filter_map(|index| Some((speed(index)?, index))).filter(|(speed, _)| *speed > 0.0).collect();
    by_speed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    by_speed.truncate((FASTEST * by_speed.len() as f64).ceil() as usize);
    let every = by_speed.len().div_ceil(MOST).max(1);
    let by_speed = by_speed.into_iter().step_by(every);
    let mut kept: Vec<usize> = by_speed.map(|(_, index)| index).collect();
    kept.sort_unstable();
    (!kept.is_empty()).then(|| recording.select(|index| kept.binary_search(&index).is_ok()))
}

/// `some` of the recording's samples with the joints that were stamped `lag` [s] later than each image; samples without such are left out.
pub(crate) fn interpolated(recording: &Recording, some: &Recording, lag: f64) -> Recording {
    let readings = Readings::new(recording);
    let samples = some.samples.iter().filter_map(|sample| {
        let joints = readings.at(sample.time? + lag)?.joints?;
        Some(Sample { joints: Some(joints), ..sample.clone() })
    });
    Recording { samples: samples.collect(), ..some.clone() }
}
