//! Images of several cameras at the same time as one sample.
use super::clock::seconds;
use super::names::Names;
use super::{Detection, Sample};
use handeye_solvers::Pose;
use std::collections::BTreeMap;

/// What one image shows.
pub(super) struct Image {
    /// [ns]
    pub stamp: i64,
    /// Index of its source.
    pub source: usize,
    /// By index, with the pixel.
    pub features: Vec<(u32, [f64; 2])>,
}

/// Images that make a sample.
pub(super) struct Group {
    /// The mean of their stamps [ns].
    pub time: i64,
    /// Indices, ordered by stamp.
    pub images: Vec<usize>,
    /// How far the first and the last are apart [ns].
    pub spread: i64,
}

/// Groups images whose stamps are `within` [ns] of the first of them, each of another camera or of exactly its stamp.
///
/// `within`: half the shortest usual time between two images of one camera where it is not given.
pub(super) fn groups(images: &[Image], camera: &[u32], within: Option<i64>) -> Vec<Group> {
    let mut order: Vec<usize> = (0..images.len()).filter(|&index| !images[index].features.is_empty()).collect();
    order.sort_by_key(|&index| images[index].stamp);
    let within = within.unwrap_or_else(|| usual_period(images, camera, &order) / 2);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    // The stamp that each camera has in the last group.
    let mut stamps: BTreeMap<u32, i64> = BTreeMap::new();
    for index in order {
        let Image { stamp, source, .. } = images[index];
        let is_near = |group: &&mut Vec<usize>| stamp.saturating_sub(images[group[0]].stamp) <= within;
        let is_first = stamps.get(&camera[source]).is_none_or(|known| *known == stamp);
        match groups.last_mut().filter(|group| is_first && is_near(group)) {
            Some(group) => group.push(index),
            None => {
                groups.push(vec![index]);
                stamps.clear();
            }
        }
        stamps.insert(camera[source], stamp);
    }
    let group = |group: Vec<usize>| {
        let first = images[group[0]].stamp;
        let later = |index: &usize| images[*index].stamp.saturating_sub(first);
        let sum: i128 = group.iter().map(|index| i128::from(later(index))).sum();
        let mean = (sum / group.len() as i128) as i64;
        let spread = group.iter().map(later).max().unwrap_or(0);
        Group { time: first.saturating_add(mean), spread, images: group }
    };
    groups.into_iter().map(group).collect()
}

/// The moments at which groups need the robot's state [ns], sorted: their own, and of images that are apart each one's.
pub(super) fn moments(groups: &[Group], images: &[Image]) -> Vec<i64> {
    let of_images = groups.iter().filter(|group| group.spread > 0).flat_map(|group| &group.images);
    let mut moments: Vec<i64> = of_images.map(|&index| images[index].stamp).collect();
    moments.extend(groups.iter().map(|group| group.time));
    moments.sort_unstable();
    moments.dedup();
    moments
}

/// Takes those groups apart between whose images [ns] the robot `moved`: a sample has one state. Returns how many these were.
pub(super) fn split(groups: Vec<Group>, images: &[Image], moved: impl Fn(i64, i64) -> bool) -> (Vec<Group>, usize) {
    let mut count = 0;
    let mut all = Vec::with_capacity(groups.len());
    for group in groups {
        let stamp = |index: &usize| images[*index].stamp;
        let first = stamp(&group.images[0]);
        if group.spread == 0 || !group.images.iter().any(|index| moved(first, stamp(index))) {
            all.push(group);
            continue;
        }
        count += 1;
        let at_once = group.images.chunk_by(|one, other| stamp(one) == stamp(other));
        all.extend(at_once.map(|images| Group { time: stamp(&images[0]), images: images.to_vec(), spread: 0 }));
    }
    all.sort_by_key(|group| group.time);
    // What one group and the next have at the same time belongs together.
    let mut merged: Vec<Group> = Vec::with_capacity(all.len());
    for group in all {
        match merged.last_mut().filter(|last| last.time == group.time && last.spread == 0 && group.spread == 0) {
            Some(last) => last.images.extend(group.images),
            None => merged.push(group),
        }
    }
    (merged, count)
}

/// The smallest median of the times between two images of one camera [ns]; 0 where none has two.
fn usual_period(images: &[Image], camera: &[u32], order: &[usize]) -> i64 {
    let n_cameras = camera.iter().max().map_or(0, |last| last + 1);
    let period = |of: u32| {
        let of_it = order.iter().map(|&index| &images[index]).filter(|image| camera[image.source] == of);
        let stamps: Vec<i64> = of_it.map(|image| image.stamp).collect();
        let mut periods: Vec<i64> = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        periods.retain(|period| *period > 0);
        periods.sort_unstable();
        periods.get(periods.len().checked_sub(1)? / 2).copied()
    };
    (0..n_cameras).filter_map(period).min().unwrap_or(0)
}

/// The samples, the features that they count by, and how many detections of a feature that its image had already were left out.
/// `states`: joints and tip pose of each group. Images give their memory back as their samples are made.
pub(super) fn samples(
    groups: &[Group],
    mut images: Vec<Image>,
    features: Names,
    camera_of_source: &[u32],
    states: impl Iterator<Item = (Option<Vec<f64>>, Option<Pose>)>,
) -> (Vec<Sample>, Vec<String>, usize) {
    let mut twice = 0;
    let mut sample = |(group, (joints, pose)): (&Group, (Option<Vec<f64>>, Option<Pose>))| {
        let number = group.images.iter().map(|&index| images[index].features.len()).sum();
        let mut pixels: Vec<Detection> = Vec::with_capacity(number);
        for &index in &group.images {
            let camera = camera_of_source[images[index].source];
            let features = std::mem::take(&mut images[index].features);
            pixels.extend(features.into_iter().map(|(feature, pixel)| Detection { camera, feature, pixel }));
        }
        pixels.sort_by_key(|detection| (detection.camera, detection.feature));
        pixels.dedup_by_key(|detection| (detection.camera, detection.feature));
        twice += number - pixels.len();
        Sample { time: Some(seconds(group.time)), joints, pose, pixels, ..Sample::default() }
    };
    let samples = groups.iter().zip(states).map(&mut sample).collect();
    (samples, features.list, twice)
}
