//! Two or more cameras: essential matrices between cameras, triangulation, and alignment from sample to sample.
use super::{Scene, Sighting, Views};
use crate::geometry::{align, relative_pose, resect_robust, triangulate};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Correspondences that two cameras must share: five determine their pose, the others say whether it is right.
const SHARED: usize = 8;

/// A triangulated feature of one sample, in the mount's frame.
type Points = BTreeMap<usize, Vector3<f64>>;

/// `None` where no two cameras share enough.
pub(super) fn reconstruct(views: &Views<'_>) -> Option<Scene> {
    let mut scene = Scene::empty(views);
    let (first, second, pose) = best_pair(views)?;
    scene.cameras[first] = Some(Pose::identity());
    scene.cameras[second] = Some(pose.inverse());
    let mut points = triangulate_all(views, &scene);
    while let Some((camera, pose)) = next_camera(views, &scene, &points) {
        scene.cameras[camera] = Some(pose);
        points = triangulate_all(views, &scene);
    }
    place_objects(views, &mut scene, &points)?;
    Some(scene)
}

/// The two cameras with most correspondences that fit one relative pose, and the second's pose `second_from_first`.
fn best_pair(views: &Views<'_>) -> Option<(usize, usize, Pose)> {
    let mut best: Option<(usize, usize, usize, Pose)> = None;
    for first in 0..views.cameras {
        for second in first + 1..views.cameras {
            let (a, b) = correspondences(views, first, second);
            if a.len() < SHARED || best.as_ref().is_some_and(|best| a.len() <= best.0) {
                continue;
            }
            let Some(found) = relative_pose(&a, &b, views.threshold, views.seed) else { continue };
            if found.inliers.len() >= SHARED && best.as_ref().is_none_or(|best| found.inliers.len() > best.0) {
                best = Some((found.inliers.len(), first, second, found.b_from_a));
            }
        }
    }
    best.map(|(_, first, second, pose)| (first, second, pose))
}

fn correspondences(views: &Views<'_>, first: usize, second: usize) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let mut pairs = (Vec::new(), Vec::new());
    for sample in views.samples {
        for a in sample.iter().filter(|sighting| sighting.camera == first) {
            if let Some(b) = sample.iter().find(|b| b.camera == second && b.feature == a.feature) {
                pairs.0.push(a.bearing);
                pairs.1.push(b.bearing);
            }
        }
    }
    pairs
}

/// The camera without a pose that sees most triangulated points, and its pose.
fn next_camera(views: &Views<'_>, scene: &Scene, points: &[Points]) -> Option<(usize, Pose)> {
    let mut best: Option<(usize, usize, Pose)> = None;
    for camera in (0..views.cameras).filter(|&camera| scene.cameras[camera].is_none()) {
        let (mut known, mut bearings) = (Vec::new(), Vec::new());
        for (sample, points) in views.samples.iter().zip(points) {
            for sighting in sample.iter().filter(|sighting| sighting.camera == camera) {
                if let Some(point) = points.get(&sighting.feature) {
                    known.push(*point);
                    bearings.push(sighting.bearing);
                }
            }
        }
        if best.as_ref().is_some_and(|best| known.len() <= best.0) {
            continue;
        }
        if let Some(found) = resect_robust(&known, &bearings, 2.0 * views.threshold, views.seed)
            && found.inliers.len() >= 6
            && 3 * found.inliers.len() >= known.len()
        {
            best = Some((known.len(), camera, found.camera_from_points.inverse()));
        }
    }
    best.map(|(_, camera, pose)| (camera, pose))
}

/// Every feature that two or more placed cameras see in one sample, where their rays meet.
fn triangulate_all(views: &Views<'_>, scene: &Scene) -> Vec<Points> {
    let in_sample = |sample: &Vec<Sighting>| {
        let mut rays: BTreeMap<usize, (Vec<Pose>, Vec<Vector3<f64>>)> = BTreeMap::new();
        for sighting in sample {
            if let Some(pose) = scene.cameras[sighting.camera] {
                let rays = rays.entry(sighting.feature).or_default();
                rays.0.push(pose.inverse());
                rays.1.push(sighting.bearing);
            }
        }
        let meet = |(feature, (cameras, bearings)): (usize, (Vec<Pose>, Vec<Vector3<f64>>))| {
            if cameras.len() < 2 {
                return None;
            }
            let point = triangulate(&cameras, &bearings)?;
            let fits = |(camera, bearing): (&Pose, &Vector3<f64>)| {
                camera.transform(&point).normalize().cross(bearing).norm() < 2.0 * views.threshold
            };
            cameras.iter().zip(&bearings).all(fits).then_some((feature, point))
        };
        rays.into_iter().filter_map(meet).collect()
    };
    views.samples.iter().map(in_sample).collect()
}

/// Chains the object's motion from sample to sample, best-connected samples first.
fn place_objects(views: &Views<'_>, scene: &mut Scene, points: &[Points]) -> Option<()> {
    let reference = (0..points.len()).rev().max_by_key(|&sample| points[sample].len())?;
    if points[reference].len() < 3 {
        return None;
    }
    scene.objects[reference] = Some(Pose::identity());
    let mut structure: Structure = points[reference].iter().map(|(&feature, &point)| (feature, (point, 1.0))).collect();
    let mut waiting: Vec<usize> = (0..points.len()).filter(|&sample| sample != reference).collect();
    loop {
        let before = waiting.len();
        let shared = |sample: usize| points[sample].keys().filter(|feature| structure.contains_key(feature)).count();
        waiting.sort_by_cached_key(|&sample| (std::cmp::Reverse(shared(sample)), sample));
        waiting.retain(|&sample| match place(&points[sample], &mut structure, views.seed) {
            Some(pose) => {
                scene.objects[sample] = Some(pose);
                false
            }
            None => true,
        });
        if waiting.len() == before {
            break;
        }
    }
    for (feature, (sum, count)) in structure {
        scene.features[feature] = Some(sum / count);
    }
    Some(())
}

/// Sum and count of each feature's positions in the object's frame.
type Structure = BTreeMap<usize, (Vector3<f64>, f64)>;

/// The object's pose in a sample that shares three or more features with the structure, which then gains the sample's.
fn place(points: &Points, structure: &mut Structure, seed: u64) -> Option<Pose> {
    let known =
        |(feature, point): (&usize, &Vector3<f64>)| structure.get(feature).map(|(sum, count)| (sum / *count, *point));
    let (from, to): (Vec<_>, Vec<_>) = points.iter().filter_map(known).unzip();
    if from.len() < 3 {
        return None;
    }
    let pose = align_robust(&from, &to, seed)?;
    for (&feature, point) in points {
        let entry = structure.entry(feature).or_insert((Vector3::zeros(), 0.0));
        entry.0 += pose.inverse_transform(point);
        entry.1 += 1.0;
    }
    Some(pose)
}

/// Alignment that up to a third of wrong points does not spoil: the triple with the least median distance, then all points
/// within three times that.
fn align_robust(from: &[Vector3<f64>], to: &[Vector3<f64>], seed: u64) -> Option<Pose> {
    let distances = |pose: &Pose| -> Vec<f64> {
        from.iter().zip(to).map(|(from, to)| (pose.transform(from) - to).norm()).collect()
    };
    let middle = |pose: &Pose| crate::calibrate::evaluate::median(&mut distances(pose));
    let mut best = align(from, to)?;
    if from.len() > 3 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..30 {
            let three: [usize; 3] = std::array::from_fn(|_| random.random_range(0..from.len()));
            if let Some(pose) = align(&three.map(|i| from[i]), &three.map(|i| to[i]))
                && middle(&pose) < 0.5 * middle(&best)
            {
                best = pose;
            }
        }
        let limit = 3.0 * middle(&best);
        let near: Vec<usize> =
            distances(&best).into_iter().enumerate().filter(|(_, d)| *d <= limit).map(|(i, _)| i).collect();
        let pick = |points: &[Vector3<f64>]| near.iter().map(|&i| points[i]).collect::<Vec<_>>();
        best = align(&pick(from), &pick(to)).unwrap_or(best);
    }
    Some(best)
}
