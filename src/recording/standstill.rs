//! Standstills: pauses between motions, of which one sample says all that the others do.
use super::{OpenOptions, Opened, Recording, Sample};
use crate::Error;
use std::cmp::Reverse;
use std::ops::Range;
use std::path::Path;

/// What stays within this stands still [rad, m]: encoders are as noisy, and in an image it is about half a pixel.
const UNMOVED: f64 = 1e-3;

/// So does what stays within this share of the way that the robot goes in [`SHORTEST`] where it is fast.
const SLOW: f64 = 0.02;

/// A standstill lasts so long [s]: several images, and longer than clocks of cameras and robots are usually apart.
const SHORTEST: f64 = 0.3;

/// The speed that this share of a recording's steps stays below is that of where it is fast: beyond are jumps of the clock.
const FAST: f64 = 0.95;

/// A recording has pauses where there are so many, and all but one sample of each are this share of it.
const PAUSES: usize = 5;
const REPEATED: f64 = 0.2;

/// Where the robot was at a time [s], and the index of the sample.
pub(super) struct Moment {
    pub time: f64,
    pub state: Vec<f64>,
    index: usize,
}

impl Recording {
    /// The pauses of the robot: indices of the samples in which for 0.3 s or longer each joint [rad, m], or each entry of the tip pose where there
    /// are no joints, stays within 0.001, or within 2 % of the way of the recording's own fast motions in that time. Ordered.
    pub fn standstills(&self) -> Vec<Range<usize>> {
        let moments = self.moments();
        let within = UNMOVED.max(SLOW * SHORTEST * fast(&moments));
        let mut found: Vec<Range<usize>> = Vec::new();
        let mut first = 0;
        while first < moments.len() {
            let end = end_of_standstill(&moments, first, within);
            if moments[end - 1].time - moments[first].time < SHORTEST {
                first += 1;
                continue;
            }
            // A reading that is off parts one pause in two.
            match found.last_mut().filter(|last| is_one(&moments[last.start..last.end], &moments[first..end], within)) {
                Some(last) => last.end = end,
                None => found.push(first..end),
            }
            first = end;
        }
        found.into_iter().map(|run| moments[run.start].index..moments[run.end - 1].index + 1).collect()
    }

    /// Joints, by their places, that stay where they are in all samples, within 0.001 rad or m; none where fewer than two are read.
    pub fn still_joints(&self) -> Vec<usize> {
        let read: Vec<&Vec<f64>> = self.samples.iter().filter_map(|sample| sample.joints.as_ref()).collect();
        let is_still = |joint: &usize| {
            let readings = || read.iter().map(|joints| joints[*joint]);
            let (low, high) = (readings().fold(f64::INFINITY, f64::min), readings().fold(f64::NEG_INFINITY, f64::max));
            high - low <= UNMOVED
        };
        (0..self.joints.len()).filter(|joint| read.len() > 1 && is_still(joint)).collect()
    }

    /// One sample of each standstill: in the middle half of its time the one with most detections, of those the one next to its middle.
    ///
    /// Errors: in words, where there is no standstill, or nothing by which it could be known.
    pub fn still(&self) -> Result<Recording, String> {
        let taken = self.one_of_each_standstill()?;
        Ok(self.select(|index| taken.binary_search(&index).is_ok()))
    }

    /// How many pauses there are, where they are plainly what was meant: most of what is recorded in them repeats.
    pub(crate) fn pauses(&self) -> Option<usize> {
        let found = self.standstills();
        let repeated = found.iter().map(|run| run.len() - 1).sum::<usize>();
        (found.len() >= PAUSES && repeated as f64 > REPEATED * self.samples.len() as f64).then_some(found.len())
    }

    /// Indices of samples, ordered. Errors: as above.
    fn one_of_each_standstill(&self) -> Result<Vec<usize>, String> {
        if self.moments().is_empty() {
            return Err(
                "--still: no sample has a time and joints or a tip pose, by which standstills are known".to_owned()
            );
        }
        let taken: Vec<usize> = self.standstills().into_iter().map(|run| self.best_of(run)).collect();
        if taken.is_empty() {
            return Err(format!(
                "--still: there is no standstill: in none of the {} samples does the robot stay where it is for {SHORTEST} s until another is taken; \
                 leave --still out",
                self.samples.len()
            ));
        }
        Ok(taken)
    }

    fn best_of(&self, run: Range<usize>) -> usize {
        let time = |index: usize| self.samples[index].time.unwrap_or_default();
        let (start, end) = (time(run.start), time(run.end - 1));
        let off = |index: usize| (time(index) - 0.5 * (start + end)).abs();
        let has_state = |index: &usize| state(self, &self.samples[*index]).is_some();
        let by_use = |a: &usize, b: &usize| {
            Reverse(detections(&self.samples[*a]))
                .cmp(&Reverse(detections(&self.samples[*b])))
                .then(off(*a).total_cmp(&off(*b)))
        };
        let inside = run.clone().filter(|index| off(*index) <= 0.25 * (end - start)).filter(has_state).min_by(by_use);
        inside.or_else(|| run.clone().filter(has_state).min_by(by_use)).unwrap_or(run.start)
    }

    /// Of the samples of which time and state are known.
    pub(super) fn moments(&self) -> Vec<Moment> {
        let moment =
            |(index, sample): (usize, &Sample)| Some(Moment { time: sample.time?, state: state(self, sample)?, index });
        self.samples.iter().enumerate().filter_map(moment).collect()
    }
}

impl Opened {
    /// One sample of each standstill where they are asked for, or a note that there are some.
    ///
    /// Errors: [`Error::Unusable`] where there are none.
    pub(super) fn still(mut self, path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
        let n_samples = self.recording.samples.len();
        if !options.still {
            let note = |pauses| format!("the robot pauses {pauses} times: --still takes one sample of each");
            self.notes.extend(self.recording.pauses().map(note));
            return Ok(self);
        }
        let unusable = |problem: String| Error::Unusable(format!("{}: {problem}", path.display()));
        let taken = self.recording.one_of_each_standstill().map_err(unusable)?;
        self.notes.push(format!("one sample of each standstill is taken: {} of {n_samples}", taken.len()));
        self.recording = self.recording.select(|index| taken.binary_search(&index).is_ok());
        if !self.images.is_empty() {
            self.images = taken.into_iter().filter_map(|index| self.images.get(index).cloned()).collect();
        }
        Ok(self)
    }
}

/// Joints, or the entries of the tip pose in a recording without joints: of a small turn they change by as much [rad].
fn state(recording: &Recording, sample: &Sample) -> Option<Vec<f64>> {
    if !recording.joints.is_empty() {
        return sample.joints.clone();
    }
    let pose = sample.pose?;
    Some(pose.rotation.iter().chain(&pose.translation).copied().collect())
}

fn detections(sample: &Sample) -> usize {
    sample.pixels.len() + sample.points.len() + sample.targets.len()
}

/// The speed of the fastest joint where the robot is fast [rad/s, m/s].
fn fast(moments: &[Moment]) -> f64 {
    let speed = |pair: &[Moment]| {
        let seconds = pair[1].time - pair[0].time;
        let way = pair[0].state.iter().zip(&pair[1].state).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
        (seconds > 0.0).then(|| way / seconds)
    };
    let mut speeds: Vec<f64> = moments.windows(2).filter_map(speed).collect();
    speeds.sort_by(f64::total_cmp);
    let place = (FAST * speeds.len() as f64) as usize;
    speeds.get(place).or(speeds.last()).copied().unwrap_or(0.0)
}

/// One after the last moment that, with all since the first, is within a band of this width, and whose time goes forward.
fn end_of_standstill(moments: &[Moment], first: usize, within: f64) -> usize {
    let mut lowest = moments[first].state.clone();
    let mut highest = lowest.clone();
    let mut end = first + 1;
    while let Some(Moment { time, state, .. }) = moments.get(end) {
        for ((low, high), now) in lowest.iter_mut().zip(&mut highest).zip(state) {
            (*low, *high) = (low.min(*now), high.max(*now));
        }
        let is_within = lowest.iter().zip(&highest).all(|(low, high)| high - low <= within);
        if !is_within || *time < moments[end - 1].time {
            break;
        }
        end += 1;
    }
    end
}

/// True where the robot did not move between two standstills that follow each other at once.
fn is_one(before: &[Moment], after: &[Moment], within: f64) -> bool {
    let (last, first) = (&before[before.len() - 1], &after[0]);
    let [from, to] = [before, after].map(|run| &run[run.len() / 2].state);
    (0.0..SHORTEST).contains(&(first.time - last.time))
        && from.iter().zip(to).all(|(from, to)| (to - from).abs() <= 2.0 * within)
}
