//! What changes with time, between the moments at which it was measured.
use crate::geometry;
use handeye_solvers::Pose;

/// What can be interpolated.
pub(in crate::recording) trait Between {
    /// `weight`: 0 at `self`, 1 at `other`.
    fn between(&self, other: &Self, weight: f64) -> Self;
}

impl Between for Vec<f64> {
    fn between(&self, other: &Self, weight: f64) -> Self {
        self.iter().zip(other).map(|(a, b)| a + weight * (b - a)).collect()
    }
}

impl Between for Pose {
    fn between(&self, other: &Self, weight: f64) -> Self {
        geometry::between(self, other, weight)
    }
}

/// Of all that was measured, what stands next to one of the moments that are asked for: memory goes with these alone.
///
/// Moment i and its predecessor enclose gap i, which ends with moment i itself; the first and the last measurement in each are kept.
#[derive(Debug)]
pub(in crate::recording) struct Track<T> {
    gaps: Vec<Option<[(i64, T); 2]>>,
    span: Option<[i64; 2]>,
}

/// A value at a moment, and how far apart the two are that it lies between [ns].
#[derive(Debug)]
pub(in crate::recording) struct At<T> {
    pub value: T,
    pub gap: i64,
}

impl<T: Clone + Between> Track<T> {
    /// For a number of moments.
    pub(in crate::recording) fn new(moments: usize) -> Self {
        Track { gaps: vec![None; moments + 1], span: None }
    }

    /// Takes a measurement, in any order; `moments` [ns] are sorted. Of two at the same time the first counts.
    pub(in crate::recording) fn add(&mut self, moments: &[i64], time: i64, value: T) {
        let [first, last] = self.span.unwrap_or([time; 2]);
        self.span = Some([first.min(time), last.max(time)]);
        let gap = &mut self.gaps[moments.partition_point(|moment| *moment < time)];
        match gap {
            None => *gap = Some([(time, value.clone()), (time, value)]),
            Some([first, _]) if time < first.0 => *first = (time, value),
            Some([_, last]) if time > last.0 => *last = (time, value),
            Some(_) => {}
        }
    }

    /// First and last time of a measurement [ns].
    pub(in crate::recording) fn span(&self) -> Option<[i64; 2]> {
        self.span
    }

    /// The values at all moments; `None` before the first measurement and after the last.
    pub(in crate::recording) fn at(&self, moments: &[i64]) -> Vec<Option<At<T>>> {
        // The next measurement after each gap.
        let mut next: Vec<Option<&(i64, T)>> = vec![None; moments.len() + 1];
        for index in (0..moments.len()).rev() {
            next[index] = self.gaps[index + 1].as_ref().map(|[first, _]| first).or(next[index + 1]);
        }
        let mut before: Option<&(i64, T)> = None;
        let at = |(index, moment): (usize, &i64)| {
            before = self.gaps[index].as_ref().map(|[_, last]| last).or(before);
            let (start, from) = before?;
            if start == moment {
                return Some(At { value: from.clone(), gap: 0 });
            }
            let (end, to) = next[index]?;
            let gap = end.saturating_sub(*start);
            let weight = moment.saturating_sub(*start) as f64 / gap as f64;
            Some(At { value: from.between(to, weight), gap })
        };
        moments.iter().enumerate().map(at).collect()
    }
}
