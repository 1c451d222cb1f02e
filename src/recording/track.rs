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
    /// The gap of the last measurement, which the next one is mostly in too.
    last: usize,
}

/// A value at a moment, and how far apart the two are that it lies between [ns].
#[derive(Clone, Debug)]
pub(in crate::recording) struct At<T> {
    pub value: T,
    pub gap: i64,
}

impl<T: Clone + Between> Track<T> {
    /// For a number of moments.
    pub(in crate::recording) fn new(moments: usize) -> Self {
        Track { gaps: vec![None; moments + 1], span: None, last: 0 }
    }

    /// Takes a measurement, in any order; `moments` [ns] are sorted. Of two at the same time the first counts.
    pub(in crate::recording) fn add(&mut self, moments: &[i64], time: i64, value: &T) {
        let [first, last] = self.span.unwrap_or([time; 2]);
        self.span = Some([first.min(time), last.max(time)]);
        let is_before = |moment: Option<&i64>| moment.is_none_or(|moment| *moment < time);
        let is_after = |moment: Option<&i64>| moment.is_none_or(|moment| *moment >= time);
        let before = self.last.checked_sub(1).and_then(|before| moments.get(before));
        if !(is_before(before) && is_after(moments.get(self.last))) {
            self.last = moments.partition_point(|moment| *moment < time);
        }
        let gap = &mut self.gaps[self.last];
        match gap {
            None => *gap = Some([(time, value.clone()), (time, value.clone())]),
            Some([first, _]) if time < first.0 => replace(first, time, value),
            Some([_, last]) if time > last.0 => replace(last, time, value),
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

/// In the memory that the old value has.
fn replace<T: Clone>(place: &mut (i64, T), time: i64, value: &T) {
    place.0 = time;
    place.1.clone_from(value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_in_any_order_are_interpolated_to_what_they_follow() {
        let moments = [10, 20, 21, 30, 45];
        let times: Vec<i64> = (0..14).map(|k| 3 * k).collect();
        let turned = (0..14).map(|k| times[(5 * k + 3) % 14]).collect();
        for order in [times.clone(), times.iter().rev().copied().collect(), turned] {
            let mut track: Track<Vec<f64>> = Track::new(moments.len());
            order.iter().for_each(|&time| track.add(&moments, time, &vec![time as f64, 1.0 - 0.5 * time as f64]));
            assert_eq!(track.span(), Some([0, 39]));
            let found = track.at(&moments);
            for (moment, at) in moments.iter().zip(&found).take(4) {
                let At { value, gap } = at.as_ref().unwrap();
                let expected = [*moment as f64, 1.0 - 0.5 * *moment as f64];
                assert!(value.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{order:?}: {value:?}");
                assert_eq!(*gap, if moment % 3 == 0 { 0 } else { 3 }, "{order:?} at {moment}");
            }
            assert!(found[4].is_none(), "nothing was measured after 39");
        }
    }
}
