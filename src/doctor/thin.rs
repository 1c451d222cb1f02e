//! A part of a long recording: a mistake of all of it shows in a hundred samples as well, and each hypothesis takes a calibration.
use crate::recording::Recording;

/// Calibrations of hypotheses look at about so many samples.
const MOST: usize = 100;

/// A feature takes part with so many samples, as far as it has them.
const OF_A_FEATURE: usize = 4;

/// Indices of samples that are spread evenly, and of some more for features that those hardly show; all where they are few.
pub(super) fn thin(recording: &Recording) -> Vec<usize> {
    let n = recording.samples.len();
    if n <= MOST {
        return (0..n).collect();
    }
    let mut taken = vec![false; n];
    (0..MOST).for_each(|k| taken[k * n / MOST] = true);
    let mut seen = vec![0; recording.features.len()];
    let shown = |index: usize| {
        let sample = &recording.samples[index];
        let of_points = sample.points.iter().map(|seen| seen.feature as usize);
        sample.pixels.iter().map(|seen| seen.feature as usize).chain(of_points)
    };
    let take = |seen: &mut [usize], index: usize| shown(index).for_each(|feature| seen[feature] += 1);
    (0..n).filter(|&index| taken[index]).for_each(|index| take(&mut seen, index));
    for (index, taken) in taken.iter_mut().enumerate().filter(|(_, taken)| !**taken) {
        if shown(index).any(|feature| seen[feature] < OF_A_FEATURE) {
            *taken = true;
            take(&mut seen, index);
        }
    }
    (0..n).filter(|&index| taken[index]).collect()
}

/// The recording of these samples.
pub(super) fn thinned(recording: &Recording) -> Recording {
    let kept = thin(recording);
    recording.select(|index| kept.binary_search(&index).is_ok())
}
