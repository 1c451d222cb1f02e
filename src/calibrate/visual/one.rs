//! One camera: structure from motion, from several first pairs of samples.
use super::{Scene, Sighting, Views};
use crate::geometry::{relative_pose_candidates, resect, resect_robust, triangulate};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Pairs of samples that are tried as the first, and scenes that are returned.
const PAIRS: usize = 48;
const SCENES: usize = 8;

/// Samples on which a pair's structure is judged.
const JUDGED: usize = 12;

/// Features that two samples must share to be a first pair.
const SHARED: usize = 6;

/// Scenes by how well the structure from their first pair explains other samples.
pub(super) fn reconstruct(views: &Views<'_>) -> Vec<Scene> {
    let mut scenes = Vec::new();
    for camera in 0..views.cameras {
        let samples: Vec<Vec<Sighting>> = views
            .samples
            .iter()
            .map(|sample| sample.iter().copied().filter(|sighting| sighting.camera == camera).collect())
            .collect();
        let mut starts: Vec<Start> =
            pairs(&samples).into_par_iter().flat_map_iter(|pair| structures(views, &samples, pair)).collect();
        starts.sort_by(|a, b| a.error.total_cmp(&b.error));
        starts.truncate(SCENES);
        scenes.par_extend(starts.into_par_iter().map(|start| complete(views, camera, &samples, start)));
    }
    scenes
}

/// A structure from one pair of samples.
struct Start {
    features: BTreeMap<usize, Vector3<f64>>,
    /// Median over the judged samples of how far bearings are off [rad].
    error: f64,
}

/// Pairs of samples that share enough features, spread over all by how far their features lie apart beyond a common
/// rotation of the camera.
fn pairs(samples: &[Vec<Sighting>]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for a in 0..samples.len() {
        for b in a + 1..samples.len() {
            let (x, y) = shared(&samples[a], &samples[b]);
            if x.len() >= SHARED {
                // Change of the distances between bearings: what a rotation of the camera would leave alone.
                let change = |i: usize, j: usize| ((x[i] - x[j]).norm() - (y[i] - y[j]).norm()).powi(2);
                let n = x.len();
                let sum: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| change(i, j)).sum();
                pairs.push((sum, n, a, b));
            }
        }
    }
    pairs.sort_by(|p, q| q.1.cmp(&p.1).then(q.0.total_cmp(&p.0)));
    // The best half by change, thinned evenly: pairs next to each other in the ranking tend to share a sample.
    let half = pairs.len().div_ceil(2).max(PAIRS.min(pairs.len()));
    let step = (half / PAIRS).max(1);
    pairs.into_iter().take(half).step_by(step).take(PAIRS).map(|(_, _, a, b)| (a, b)).collect()
}

fn shared(a: &[Sighting], b: &[Sighting]) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let other = |sighting: &Sighting| b.iter().find(|b| b.feature == sighting.feature);
    a.iter().filter_map(|sighting| other(sighting).map(|b| (sighting.bearing, b.bearing))).unzip()
}

fn structures(views: &Views<'_>, samples: &[Vec<Sighting>], (a, b): (usize, usize)) -> Vec<Start> {
    let (x, y) = shared(&samples[a], &samples[b]);
    let names: Vec<usize> = samples[a]
        .iter()
        .filter(|sighting| samples[b].iter().any(|other| other.feature == sighting.feature))
        .map(|sighting| sighting.feature)
        .collect();
    let step = (samples.len() / JUDGED).max(1);
    let candidates = relative_pose_candidates(&x, &y, views.threshold, views.seed);
    let build = |b_from_a: Pose| {
        let cameras = [Pose::identity(), b_from_a];
        let features: BTreeMap<usize, Vector3<f64>> = names
            .iter()
            .zip(x.iter().zip(&y))
            .filter_map(|(&name, (x, y))| Some((name, triangulate(&cameras, &[*x, *y])?)))
            .collect();
        let error = |sample: &Vec<Sighting>| {
            let (points, bearings) = known(&features, sample);
            resect(&points, &bearings).first().map(|pose| median_angle(pose, &points, &bearings))
        };
        let judged = samples.iter().step_by(step).chain([&samples[a], &samples[b]]);
        let mut errors: Vec<f64> = judged.map(|sample| error(sample).unwrap_or(1.0)).collect();
        Start { features, error: crate::calibrate::evaluate::median(&mut errors) }
    };
    candidates
        .into_iter()
        .map(|candidate| build(candidate.b_from_a))
        .filter(|start| start.features.len() >= 4)
        .collect()
}

fn known(features: &BTreeMap<usize, Vector3<f64>>, sample: &[Sighting]) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let point = |sighting: &Sighting| features.get(&sighting.feature).map(|point| (*point, sighting.bearing));
    sample.iter().filter_map(point).unzip()
}

fn median_angle(pose: &Pose, points: &[Vector3<f64>], bearings: &[Vector3<f64>]) -> f64 {
    let angle =
        |(point, bearing): (&Vector3<f64>, &Vector3<f64>)| pose.transform(point).normalize().cross(bearing).norm();
    crate::calibrate::evaluate::median(&mut points.iter().zip(bearings).map(angle).collect::<Vec<_>>())
}

/// Places every sample by the structure, and every other feature by the samples.
fn complete(views: &Views<'_>, camera: usize, samples: &[Vec<Sighting>], start: Start) -> Scene {
    let mut scene = Scene::empty(views);
    scene.cameras[camera] = Some(Pose::identity());
    let mut features = start.features;
    for _ in 0..2 {
        for (object, sample) in scene.objects.iter_mut().zip(samples) {
            let (points, bearings) = known(&features, sample);
            let plain = resect(&points, &bearings).first().copied();
            let fits = |pose: &Pose| median_angle(pose, &points, &bearings) < views.threshold;
            *object = plain.filter(fits).or_else(|| {
                let found = resect_robust(&points, &bearings, 3.0 * views.threshold, views.seed)?;
                Some(found.camera_from_points)
            });
        }
        let mut rays: BTreeMap<usize, (Vec<Pose>, Vec<Vector3<f64>>)> = BTreeMap::new();
        for (object, sample) in scene.objects.iter().zip(samples) {
            for sighting in sample {
                if let (Some(pose), false) = (object, features.contains_key(&sighting.feature)) {
                    let rays = rays.entry(sighting.feature).or_default();
                    rays.0.push(*pose);
                    rays.1.push(sighting.bearing);
                }
            }
        }
        for (feature, (cameras, bearings)) in rays {
            if let Some(point) = triangulate(&cameras, &bearings) {
                features.insert(feature, point);
            }
        }
    }
    for (feature, point) in features {
        scene.features[feature] = Some(point);
    }
    scene
}
