//! Where the robot was between the samples, and its readings stamped anew where its clock and the images' are apart.
use super::{OpenOptions, Opened, Recording, Sample};
use crate::Error;
use crate::geometry;
use handeye_solvers::Pose;
use std::path::Path;

/// Samples are dense where the median step of a joint is below this share of its range.
const DENSE: f64 = 0.15;

/// The robot's readings, to be asked for what lies between them.
pub(crate) struct Readings<'a> {
    /// Times [s], ascending, and the samples.
    rows: Vec<(f64, &'a Sample)>,
}

/// Where the robot was at some time.
pub(crate) struct At {
    pub joints: Option<Vec<f64>>,
    pub pose: Option<Pose>,
    /// How far apart the two readings are that it lies between [s].
    gap: f64,
}

impl<'a> Readings<'a> {
    /// Of several at one time the first counts.
    pub fn new(recording: &'a Recording) -> Self {
        let read = |sample: &'a Sample| {
            let is_read = sample.joints.is_some() || sample.pose.is_some();
            Some((sample.time.filter(|_| is_read)?, sample))
        };
        let mut rows: Vec<(f64, &Sample)> = recording.samples.iter().filter_map(read).collect();
        rows.sort_by(|one, other| one.0.total_cmp(&other.0));
        rows.dedup_by(|later, first| later.0 == first.0);
        Readings { rows }
    }

    /// Joints follow the cubic through the two readings that the time lies between, with slopes from the readings before and after (an error of
    /// fourth order in their distance); tip poses the way between the two. `None` before the first reading and after the last.
    pub fn at(&self, time: f64) -> Option<At> {
        let after = self.rows.partition_point(|(stamp, _)| *stamp < time);
        let (next, following) = self.rows.get(after)?;
        if *next == time {
            return Some(At { joints: following.joints.clone(), pose: following.pose, gap: 0.0 });
        }
        let (before, leading) = self.rows.get(after.checked_sub(1)?)?;
        let gap = next - before;
        let share = (time - before) / gap;
        let joints = leading.joints.as_ref().zip(following.joints.as_ref());
        let joints = joints.map(|(from, to)| {
            let slope = |row: usize, joint: usize| gap * self.slope(row, joint);
            let cubic =
                |joint: usize| hermite(share, [from[joint], to[joint]], [slope(after - 1, joint), slope(after, joint)]);
            (0..from.len()).map(cubic).collect()
        });
        let pose = leading.pose.zip(following.pose);
        let pose = pose.map(|(from, to)| geometry::between(&from, &to, share));
        Some(At { joints, pose, gap })
    }

    /// How fast a joint goes at a reading: that of the parabola through it and its neighbours [1/s].
    fn slope(&self, row: usize, joint: usize) -> f64 {
        let reading = |row: usize| {
            let (time, sample) = self.rows.get(row)?;
            Some((*time, *sample.joints.as_ref()?.get(joint)?))
        };
        let secant = |from: usize, to: usize| {
            let ((start, from), (end, to)) = (reading(from)?, reading(to)?);
            Some((end - start, (to - from) / (end - start)))
        };
        let behind = row.checked_sub(1).and_then(|before| secant(before, row));
        match (behind, secant(row, row + 1)) {
            (Some((h, before)), Some((g, after))) => (g * before + h * after) / (h + g),
            (Some((_, slope)), None) | (None, Some((_, slope))) => slope,
            (None, None) => 0.0,
        }
    }
}

/// The cubic with these values and slopes at 0 and 1.
fn hermite(x: f64, [from, to]: [f64; 2], [leaving, arriving]: [f64; 2]) -> f64 {
    let y = 1.0 - x;
    from * y * y * (1.0 + 2.0 * x) + to * x * x * (1.0 + 2.0 * y) + x * y * (leaving * y - arriving * x)
}

impl Recording {
    /// Median time between samples [s], where the robot moves so little over it that what lies between two of them is known; `None` where not.
    pub(crate) fn dense_period(&self) -> Option<f64> {
        let moments = self.moments();
        if moments.len() < 10 || moments.len() < self.samples.len() / 2 {
            return None;
        }
        let is_dense = |k: usize| {
            let readings = || moments.iter().map(|moment| moment.state[k]);
            let range = readings().fold(f64::NEG_INFINITY, f64::max) - readings().fold(f64::INFINITY, f64::min);
            let steps = moments.windows(2).map(|pair| (pair[1].state[k] - pair[0].state[k]).abs());
            middle(steps.collect()) <= DENSE * range
        };
        let period = middle(moments.windows(2).map(|pair| pair[1].time - pair[0].time).collect());
        (period > 0.0 && (0..moments[0].state.len()).all(is_dense)).then_some(period)
    }

    /// The samples with the readings that are of their time where those of all are stamped `delay` [s] later, and how far apart the two are at most
    /// between which they lie [s]. `None` in place of a sample that then has no readings.
    ///
    /// Errors: in words, where that cannot be known.
    fn delayed(&self, delay: f64) -> Result<(Vec<Option<Sample>>, f64), String> {
        if self.samples.iter().any(|sample| sample.joint_action.is_some() || sample.pose_action.is_some()) {
            return Err("commanded motions are from one sample to the next, and cannot be stamped anew".to_owned());
        }
        if self.dense_period().is_none() {
            return Err("samples have no times, or the robot moves too far from one to the next to know where it was between them".to_owned());
        }
        let readings = Readings::new(self);
        let mut widest: f64 = 0.0;
        let anew = |sample: &Sample| {
            let At { joints, pose, gap } = readings.at(sample.time? - delay)?;
            widest = widest.max(gap);
            Some(Sample { joints, pose, ..sample.clone() })
        };
        let samples = self.samples.iter().map(anew).collect();
        Ok((samples, widest))
    }
}

impl Opened {
    /// Stamps the robot's readings anew where that is asked for.
    ///
    /// Errors: [`Error::Unusable`] where what lies between samples is not known.
    pub(super) fn delayed(mut self, path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
        let Some(delay) = options.joint_delay.filter(|delay| *delay != 0.0) else { return Ok(self) };
        let unusable = |problem: String| Error::Unusable(format!("{}: --joint-delay: {problem}", path.display()));
        let (samples, widest) = self.recording.delayed(delay).map_err(unusable)?;
        let is_kept: Vec<bool> = samples.iter().map(Option::is_some).collect();
        self.recording.samples = samples.into_iter().flatten().collect();
        if !self.images.is_empty() {
            let mut kept = is_kept.iter();
            self.images.retain(|_| kept.next().copied().unwrap_or(false));
        }
        self.notes.push(format!(
            "the robot's readings are stamped {delay} s later, and interpolated to the times of the samples, between two that are up to {widest:.6} s \
             apart"
        ));
        let left_out = is_kept.iter().filter(|is_kept| !**is_kept).count();
        if left_out > 0 {
            self.notes.push(format!("samples without readings before and after, which are left out: {left_out}"));
        }
        Ok(self)
    }
}

fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
