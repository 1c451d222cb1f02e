//! A lag between the clocks of robot and images, where samples are dense enough to interpolate joints between them.
use super::Watch;
use super::pixels::{learn, misfit};
use crate::calibrate::{Options, evaluate};
use crate::recording::{Recording, Sample};
use crate::rig::Rig;

/// Samples are dense where the median step of a joint is below this share of its range.
const DENSE: f64 = 0.15;

/// Lags are tried up to so many sample periods, in steps of so much of one.
const PERIODS: f64 = 5.0;
const STEP: f64 = 0.1;

/// Turns of learning a rig and finding the lag under it.
const ROUNDS: usize = 6;

/// A lag found: seconds by which joints are stamped late, and the recording without it.
pub(super) struct Lag {
    pub seconds: f64,
    pub recording: Recording,
}

/// The lag at which a rig explains the images best, found in turns with the rig. `None` where samples are not dense in time or
/// nothing can be learned.
pub(super) fn find(rig: &Rig, recording: &Recording, options: &Options, watch: &mut Watch<'_>) -> Option<Lag> {
    let period = period(recording)?;
    let mut lag = Lag { seconds: 0.0, recording: recording.clone() };
    for _ in 0..ROUNDS {
        let learned = learn(rig, &lag.recording, options, "a lag", watch).ok()?;
        let misfit_at = |k: i32| {
            let shifted = interpolated(recording, f64::from(k) * STEP * period);
            evaluate(&learned.rig, &shifted).map_or(f64::INFINITY, |judged| misfit(&judged.total).size())
        };
        let most = (PERIODS / STEP).round() as i32;
        let best = (-most..=most)
            .map(|k| (misfit_at(k), k))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.abs().cmp(&b.1.abs())))?;
        let seconds = f64::from(best.1) * STEP * period;
        let settled = seconds == lag.seconds;
        lag = Lag { seconds, recording: interpolated(recording, seconds) };
        if settled {
            break;
        }
    }
    (lag.seconds != 0.0).then_some(lag)
}

/// Median time between samples [s], where joints change little over it.
fn period(recording: &Recording) -> Option<f64> {
    let rows: Vec<(f64, &Vec<f64>)> =
        recording.samples.iter().filter_map(|sample| Some((sample.time?, sample.joints.as_ref()?))).collect();
    if rows.len() < 10 || rows.len() < recording.samples.len() / 2 {
        return None;
    }
    let median = |mut values: Vec<f64>| crate::calibrate::median(&mut values);
    let dense = |joint: usize| {
        let readings = || rows.iter().map(|(_, joints)| joints[joint]);
        let range = readings().fold(f64::NEG_INFINITY, f64::max) - readings().fold(f64::INFINITY, f64::min);
        let steps = rows.windows(2).map(|pair| (pair[1].1[joint] - pair[0].1[joint]).abs()).collect();
        median(steps) <= DENSE * range
    };
    let period = median(rows.windows(2).map(|pair| pair[1].0 - pair[0].0).collect());
    (period > 0.0 && (0..recording.joints.len()).all(dense)).then_some(period)
}

/// The recording with the joints that were stamped `lag` [s] later than each image, linear between stamps; samples without
/// such are left out.
fn interpolated(recording: &Recording, lag: f64) -> Recording {
    let rows: Vec<(f64, &Vec<f64>)> =
        recording.samples.iter().filter_map(|sample| Some((sample.time?, sample.joints.as_ref()?))).collect();
    let at = |time: f64| -> Option<Vec<f64>> {
        let after = rows.partition_point(|(stamp, _)| *stamp < time);
        let (next, joints) = rows.get(after)?;
        if *next == time {
            return Some((*joints).clone());
        }
        let (before, from) = rows.get(after.checked_sub(1)?)?;
        let share = (time - before) / (next - before);
        Some(from.iter().zip(*joints).map(|(a, b)| a + share * (b - a)).collect())
    };
    let samples = recording.samples.iter().filter_map(|sample| {
        let joints = at(sample.time? + lag)?;
        Some(Sample { joints: Some(joints), ..sample.clone() })
    });
    Recording { samples: samples.collect(), ..recording.clone() }
}
