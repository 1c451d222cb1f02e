//! A depth camera, or two or more others: essential matrices between cameras, triangulation, and alignment from sample to sample.
use super::{Scene, Sighting, Views};
use crate::geometry::{align_robust, relative_pose, resect_robust, triangulate};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Correspondences that two cameras must share: five determine their pose, the others say whether it is right.
const SHARED: usize = 8;

/// Points that a depth camera must share with the others: three determine its pose, the fourth says whether it is right.
const SHARED_POINTS: usize = 4;

/// Located features of one sample, in the mount's frame.
type Points = BTreeMap<usize, Vector3<f64>>;

/// From depth cameras, and from two others where that leaves anything open; empty where no depth camera sees enough and no two
/// cameras share enough.
pub(super) fn reconstruct(views: &Views<'_>) -> Vec<Scene> {
    match from_depth(views) {
        Some(scene) if scene.is_whole(views) => vec![scene],
        scene => scene.into_iter().chain(from_pair(views)).collect(),
    }
}

/// From the depth camera with most points, in metres.
fn from_depth(views: &Views<'_>) -> Option<Scene> {
    let mut counts = vec![0; views.cameras];
    let sightings = views.samples.iter().flatten();
    sightings.filter(|sighting| sighting.point.is_some()).for_each(|sighting| counts[sighting.camera] += 1);
    let first = (0..views.cameras).rev().max_by_key(|&camera| counts[camera]).filter(|&camera| counts[camera] > 0)?;
    let mut scene = Scene::empty(views);
    scene.cameras[first] = Some(Pose::identity());
    complete(views, scene, &|sighting| sighting.point)
}

/// From two cameras, in units of their distance.
fn from_pair(views: &Views<'_>) -> Option<Scene> {
    let mut scene = Scene::empty(views);
    let (first, second, pose) = best_pair(views)?;
    scene.cameras[first] = Some(Pose::identity());
    scene.cameras[second] = Some(pose.inverse());
    complete(views, scene, &|_| None)
}

/// The point of a sighting, where it is in the unit of the scene.
type Measured<'a> = &'a dyn Fn(&Sighting) -> Option<Vector3<f64>>;

/// Adds cameras as long as one can be placed, then places the object in every sample.
fn complete(views: &Views<'_>, mut scene: Scene, measured: Measured<'_>) -> Option<Scene> {
    let mut points = locate_all(views, &scene, measured);
    while let Some((camera, pose)) = next_camera(views, &scene, &points, measured) {
        scene.cameras[camera] = Some(pose);
        points = locate_all(views, &scene, measured);
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

/// The camera without a pose that sees most located features, and its pose.
fn next_camera(views: &Views<'_>, scene: &Scene, points: &[Points], measured: Measured<'_>) -> Option<(usize, Pose)> {
    let mut best: Option<(usize, usize, Pose)> = None;
    for camera in (0..views.cameras).filter(|&camera| scene.cameras[camera].is_none()) {
        let (mut known, mut bearings) = (Vec::new(), Vec::new());
        let (mut in_mount, mut in_camera) = (Vec::new(), Vec::new());
        for (sample, points) in views.samples.iter().zip(points) {
            for sighting in sample.iter().filter(|sighting| sighting.camera == camera) {
                let Some(point) = points.get(&sighting.feature) else { continue };
                known.push(*point);
                bearings.push(sighting.bearing);
                if let Some(measured) = measured(sighting) {
                    in_mount.push(*point);
                    in_camera.push(measured);
                }
            }
        }
        if best.as_ref().is_some_and(|best| known.len() <= best.0) {
            continue;
        }
        let aligned = (in_camera.len() >= SHARED_POINTS).then(|| align_robust(&in_camera, &in_mount, views.seed));
        let resected = || {
            let found = resect_robust(&known, &bearings, 2.0 * views.threshold, views.seed)?;
            let is_good = found.inliers.len() >= 6 && 3 * found.inliers.len() >= known.len();
            is_good.then(|| found.camera_from_points.inverse())
        };
        if let Some(pose) = aligned.flatten().or_else(resected) {
            best = Some((known.len(), camera, pose));
        }
    }
    best.map(|(_, camera, pose)| (camera, pose))
}

/// Every feature of each sample that placed depth cameras measured (their mean), or that two or more placed cameras see,
/// where their rays meet.
fn locate_all(views: &Views<'_>, scene: &Scene, measured: Measured<'_>) -> Vec<Points> {
    let in_sample = |sample: &Vec<Sighting>| {
        let mut rays: BTreeMap<usize, (Vec<Pose>, Vec<Vector3<f64>>)> = BTreeMap::new();
        let mut direct: BTreeMap<usize, (Vector3<f64>, f64)> = BTreeMap::new();
        for sighting in sample {
            let Some(pose) = scene.cameras[sighting.camera] else { continue };
            if let Some(point) = measured(sighting) {
                let entry = direct.entry(sighting.feature).or_insert((Vector3::zeros(), 0.0));
                *entry = (entry.0 + pose.transform(&point), entry.1 + 1.0);
            }
            let rays = rays.entry(sighting.feature).or_default();
            rays.0.push(pose.inverse());
            rays.1.push(sighting.bearing);
        }
        let meet = |(feature, (cameras, bearings)): (usize, (Vec<Pose>, Vec<Vector3<f64>>))| {
            if let Some((sum, count)) = direct.get(&feature) {
                return Some((feature, sum / *count));
            }
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
