//! What a motion teaches: the updates of an estimate.
use super::estimate::{Estimate, dot};
use super::settings::Update;
use super::signals::Row;
use std::collections::BTreeSet;

/// A motion, and the errors before and after it [px]; NaN where a row was not seen.
pub(super) struct Lesson<'a> {
    pub motion: &'a [f64],
    pub before: &'a [f64],
    pub now: &'a [f64],
    /// Rows that are seen now.
    pub seen: &'a [usize],
    /// The rows, where slopes came from a model: a camera of which it is found wrong is trusted less.
    pub modelled: Option<&'a [Row]>,
}

/// Bounds of the ratio of a squared surprise to the expected one by which the curvature follows, and of the curvature over its setting.
const SURPRISE: [f64; 2] = [0.2, 30.0];
const CURVATURES: [f64; 2] = [0.5, 10.0];

/// The power of that ratio: ½ is what explains the surprise best, which caution takes whole; confidence grows half as fast.
const UP: f64 = 0.5;
const DOWN: f64 = 0.25;

/// Median of χ² with 1 degree of freedom, and by how much the ratio may exceed that of the median row.
const MEDIAN: f64 = 0.455;
const ALONE: f64 = 3.0;

/// Learns. `curvature`: the setting.
pub(super) fn learn(update: Update, curvature: f64, estimate: &mut Estimate, lesson: &Lesson<'_>) {
    match update {
        Update::Adaptive => return filter(curvature, estimate, lesson),
        Update::Broyden { rate, gate } if tells(estimate, lesson, gate) => {
            let square = dot(lesson.motion, lesson.motion);
            for (row, change) in changes(lesson) {
                let news = change - dot(estimate.slopes(row), lesson.motion);
                estimate.tilt(row, rate * news / square, lesson.motion);
            }
        }
        Update::LeastSquares { forgetting, gate } if tells(estimate, lesson, gate) => {
            estimate.forget(1.0 / forgetting);
            estimate.moved(lesson.motion, 0.0);
            for (row, _) in changes(lesson) {
                estimate.measured(row, lesson.now[row]);
            }
        }
        Update::Keep | Update::Broyden { .. } | Update::LeastSquares { .. } => {}
    }
    for &row in lesson.seen {
        estimate.reset(row, lesson.now[row]);
    }
}

/// Changes of the rows that were seen before and after the motion [px].
fn changes<'a>(lesson: &Lesson<'a>) -> impl Iterator<Item = (usize, f64)> + use<'a> {
    let (before, now) = (lesson.before, lesson.now);
    lesson
        .seen
        .iter()
        .map(move |&row| (row, now[row] - before.get(row).unwrap_or(&f64::NAN)))
        .filter(|(_, change)| change.is_finite())
}

/// Whether both the change that was seen and what is new of it exceed so many standard deviations of their noise.
fn tells(estimate: &Estimate, lesson: &Lesson<'_>, gate: f64) -> bool {
    let (mut change, mut news, mut rows) = (0.0, 0.0, 0.0);
    for (row, difference) in changes(lesson) {
        let variance = 2.0 * estimate.variance(row);
        change += difference * difference / variance;
        news += (difference - dot(estimate.slopes(row), lesson.motion)).powi(2) / variance;
        rows += 1.0;
    }
    rows > 0.0 && lesson.motion.iter().any(|motion| *motion != 0.0) && f64::min(change, news) >= gate * gate * rows
}

fn filter(setting: f64, estimate: &mut Estimate, lesson: &Lesson<'_>) {
    // First how far slopes are to be trusted, then what this motion teaches: a surprise is neither learned from as if it had been expected,
    // nor are slopes trusted after it as if there had been none.
    if let Some(rows) = lesson.modelled {
        doubt(rows, estimate, lesson);
    }
    bend(setting, estimate, lesson);
    estimate.moved(lesson.motion, estimate.curvature);
    for &row in lesson.seen {
        estimate.measured(row, lesson.now[row]);
    }
}

/// The curvature follows the surprise that a motion is.
fn bend(setting: f64, estimate: &mut Estimate, lesson: &Lesson<'_>) {
    let (mut surprise, mut expected, mut noise) = (0.0, 0.0, 0.0);
    let mut each = Vec::with_capacity(lesson.seen.len());
    let bend = estimate.bend(lesson.motion);
    for &row in lesson.seen {
        let there = estimate.error(row) + dot(estimate.slopes(row), lesson.motion);
        let variance = estimate.variance_bent(row, lesson.motion, bend);
        let square = (lesson.now[row] - there).powi(2);
        each.push(square / variance);
        surprise += square;
        expected += variance;
        noise += 2.0 * estimate.variance(row);
    }
    if expected > noise {
        // A few trackers that fail say nothing of how slopes change: half of the rows have to be surprised too.
        let middle = each.len() / 2;
        let median = *each.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN;
        let ratio = (surprise / expected).min(ALONE * median).clamp(SURPRISE[0], SURPRISE[1]);
        let power = if ratio > 1.0 { UP } else { DOWN };
        let curvature = estimate.curvature * ratio.powf(power * (1.0 - noise / expected));
        estimate.curvature = curvature.clamp(CURVATURES[0] * setting, CURVATURES[1] * setting);
    }
}

/// Surprises of one camera's rows that are larger than their variances by so many standard deviations of their χ² speak against the model.
const SURPRISED: f64 = 5.0;

/// Raises the variance of the slopes of each camera that surprises to what explains the surprise best: one camera has moved, or all have
/// as the arm did, and slopes are learned anew while those of the others stay.
fn doubt(rows: &[Row], estimate: &mut Estimate, lesson: &Lesson<'_>) {
    let square = dot(lesson.motion, lesson.motion);
    if square == 0.0 {
        return;
    }
    let cameras: BTreeSet<usize> = lesson.seen.iter().map(|&row| rows[row].camera).collect();
    for camera in cameras {
        let of_camera = || lesson.seen.iter().copied().filter(|&row| rows[row].camera == camera);
        let (mut ratio, mut excess, mut scale, mut count) = (0.0, 0.0, 0.0, 0.0_f64);
        for row in of_camera() {
            let [there, variance] = estimate.foresee(row, lesson.motion);
            let surprise = (lesson.now[row] - there).powi(2);
            ratio += surprise / variance;
            excess += surprise - variance;
            scale += estimate.scale(row);
            count += 1.0;
        }
        if ratio > count + SURPRISED * (2.0 * count).sqrt() && scale > 0.0 && excess > 0.0 {
            let share = excess / (square * scale);
            of_camera().for_each(|row| estimate.loosen(row, share * estimate.scale(row)));
        }
    }
}
