//! How far the clock of the images is ahead of the robot's, from angular speeds alone (Furrer et al. 2017).
//!
//! The speed at which a rigid body turns is the same in every frame, so that the target's turning in the image and the tip's are
//! one function of time, up to the offset.
use handeye_solvers::Pose;

/// Offsets that are tried [s].
const LARGEST: f64 = 0.5;
const STEP: f64 = 0.004;

/// Turns are measured over this long [s]: noise would drown them between neighbouring samples.
const WINDOW: f64 = 0.1;

/// The offset of the images' clock [s] at which the correlation of the speeds is largest; 0 where they say nothing.
///
/// `robot` and `images`: times, ascending [s], and poses of something that turns with the tip.
pub(super) fn offset(robot: (&[f64], &[Pose]), images: (&[f64], &[Pose])) -> f64 {
    let (robot, images) = (speeds(robot), speeds(images));
    let steps = (LARGEST / STEP).round() as i32;
    let score = |k: i32| correlation(&robot, &images, f64::from(k) * STEP).unwrap_or(f64::NEG_INFINITY);
    let scores: Vec<(f64, i32)> = (-steps..=steps).map(|k| (score(k), k)).collect();
    let best = scores.iter().fold((f64::NEG_INFINITY, 0), |best, next| if next.0 > best.0 { *next } else { best });
    f64::from(best.1) * STEP
}

/// Times and angular speeds [rad/s] over the window.
fn speeds((times, poses): (&[f64], &[Pose])) -> Vec<(f64, f64)> {
    let pairs = (0..times.len()).filter_map(|i| {
        let j = times.partition_point(|t| *t < times[i] + WINDOW);
        (j < times.len()).then(|| (0.5 * (times[i] + times[j]), poses[i].angle_to(&poses[j]) / (times[j] - times[i])))
    });
    pairs.collect()
}

fn correlation(robot: &[(f64, f64)], images: &[(f64, f64)], offset: f64) -> Option<f64> {
    let pairs: Vec<(f64, f64)> =
        images.iter().filter_map(|&(t, speed)| Some((interpolate(robot, t - offset)?, speed))).collect();
    let n = pairs.len() as f64;
    if pairs.len() < 10 || 2 * pairs.len() < images.len() {
        return None;
    }
    let (mean_a, mean_b) = pairs.iter().fold((0.0, 0.0), |(a, b), pair| (a + pair.0 / n, b + pair.1 / n));
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(a, b)| f(a - mean_a, b - mean_b)).sum::<f64>();
    let spread = (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    (spread > 0.0).then(|| sum(&|a, b| a * b) / spread)
}

fn interpolate(curve: &[(f64, f64)], t: f64) -> Option<f64> {
    let after = curve.partition_point(|(time, _)| *time < t);
    let ((t0, y0), (t1, y1)) = (*curve.get(after.checked_sub(1)?)?, *curve.get(after)?);
    Some(y0 + (y1 - y0) * (t - t0) / (t1 - t0).max(1e-9))
}
