//! A part of a large recording: a mistake of all of it shows in a hundred samples and a few features of each image as well, and each hypothesis
//! takes a calibration.
use crate::recording::{Recording, Sample};
use crate::rig::Rig;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

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
    let shown = |index: usize| shown(&recording.samples[index]);
    let take = |seen: &mut [usize], index: usize| shown(index).for_each(|(_, feature)| seen[feature] += 1);
    (0..n).filter(|&index| taken[index]).for_each(|index| take(&mut seen, index));
    for (index, taken) in taken.iter_mut().enumerate().filter(|(_, taken)| !**taken) {
        if shown(index).any(|(_, feature)| seen[feature] < OF_A_FEATURE) {
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

/// Images keep so many features, where they have more.
const IN_IMAGE: usize = 16;

/// Of the order in which features are left out: those of a board that are next to one another in the recording may be in one line.
const SEED: u64 = 1;

/// Rig and recording with fewer features in images that show many; the same where lengths between features are given.
pub(super) fn with_fewer_features(rig: &Rig, recording: &Recording) -> (Rig, Recording) {
    let mut rig = rig.clone();
    if rig.estimate.tag_side.is_some() || !rig.estimate.lengths.is_empty() {
        return (rig, recording.clone());
    }
    let is_kept = choose(recording);
    let is_dropped =
        |name: &String| recording.features.iter().zip(&is_kept).any(|(known, kept)| !kept && known == name);
    rig.features.retain(|feature| !is_dropped(&feature.name));
    (rig, recording.select_features(|feature| is_kept[feature]))
}

/// Which features stay: one after another is left out, as long as all images that show it keep enough.
fn choose(recording: &Recording) -> Vec<bool> {
    let n = recording.features.len();
    let mut of_feature: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut in_image: Vec<usize> = Vec::new();
    for sample in &recording.samples {
        let first = in_image.len();
        in_image.resize(first + recording.cameras.len(), 0);
        for (camera, feature) in shown(sample) {
            in_image[first + camera] += 1;
            of_feature[feature].push(first + camera);
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(SEED));
    let mut is_kept = vec![true; n];
    for feature in order {
        let images = &of_feature[feature];
        if images.iter().all(|&image| in_image[image] > IN_IMAGE) {
            is_kept[feature] = false;
            images.iter().for_each(|&image| in_image[image] -= 1);
        }
    }
    is_kept
}

/// Camera and feature of all that a sample shows.
fn shown(sample: &Sample) -> impl Iterator<Item = (usize, usize)> {
    let of_points = sample.points.iter().map(|seen| (seen.camera as usize, seen.feature as usize));
    sample.pixels.iter().map(|seen| (seen.camera as usize, seen.feature as usize)).chain(of_points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Detection, PointDetection, RecordedCamera};
    use crate::rig::{Ends, Feature, Length, Parent};

    /// A camera that sees a board of 60, and one that sees 5 of its features and 3 others.
    fn recording() -> Recording {
        let detection = |camera: u32, feature: u32| Detection { camera, feature, pixel: [f64::from(feature), 0.0] };
        let pixels = (0..60).map(|feature| detection(0, feature)).chain((20..25).map(|feature| detection(1, feature)));
        let points =
            (60..63).map(|feature| PointDetection { camera: 1, feature, point: [f64::from(feature), 0.0, 1.0] });
        let sample = Sample { pixels: pixels.collect(), points: points.collect(), ..Sample::default() };
        let cameras = ["many", "few"].map(|name| RecordedCamera { name: name.into(), ..RecordedCamera::default() });
        let features = (0..63).map(|feature| format!("f{feature}")).collect();
        Recording { cameras: cameras.into(), features, samples: vec![sample; 3], ..Recording::default() }
    }

    #[test]
    fn images_with_many_features_keep_some_and_others_keep_all() {
        let recording = recording();
        let features =
            recording.features.iter().map(|name| Feature { name: name.clone(), parent: Parent::Tip, xyz: None });
        let rig = Rig { features: features.collect(), ..Rig::default() };
        let (fewer_of_rig, fewer) = with_fewer_features(&rig, &recording);
        let names: Vec<&String> = fewer_of_rig.features.iter().map(|feature| &feature.name).collect();
        assert_eq!(names, fewer.features.iter().collect::<Vec<_>>());
        for sample in &fewer.samples {
            let of = |camera: u32| sample.pixels.iter().filter(move |seen| seen.camera == camera).count();
            assert_eq!((of(0), of(1), sample.points.len()), (IN_IMAGE, 5, 3));
            // Numbers of features moved, what was seen of each did not.
            let seen = sample.pixels.iter().map(|seen| (seen.feature, seen.pixel[0]));
            for (feature, place) in seen.chain(sample.points.iter().map(|seen| (seen.feature, seen.point[0]))) {
                assert_eq!(fewer.features[feature as usize], format!("f{place}"));
            }
        }
    }

    #[test]
    fn features_between_which_lengths_are_given_stay() {
        let between = Ends::Features(["f0".into(), "f1".into()]);
        let mut rig = Rig::default();
        rig.estimate.lengths.push(Length { between, length: 0.1, sd: 0.001 });
        assert_eq!(with_fewer_features(&rig, &recording()).1, recording());
    }
}
