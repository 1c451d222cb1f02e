//! Brings in what the first look could not place, and says what is missing where that is not possible.
use super::graph::State;
use super::setup::{Observation, Setup};
use crate::Error;
use crate::geometry::{resect_robust, triangulate};
use nalgebra::Vector3;

/// Largest error of a good bearing while joining [px].
const THRESHOLD_PX: f64 = 6.0;

/// Places every camera among the known features by resection and every feature by triangulation, in turns, until nothing
/// is left or nothing more can be placed.
pub(crate) fn join(
    setup: &Setup,
    state: &mut State,
    cameras: &[bool],
    features: &[bool],
    seed: u64,
) -> Result<(), Error> {
    let mut cameras = cameras.to_vec();
    let mut features = features.to_vec();
    let links = state.all_links(setup);
    loop {
        let before = (cameras.clone(), features.clone());
        for (feature, placed) in features.iter_mut().enumerate().filter(|(_, placed)| !**placed) {
            *placed = place_feature(setup, state, &links, &cameras, feature);
        }
        for (camera, placed) in cameras.iter_mut().enumerate().filter(|(_, placed)| !**placed) {
            *placed = place_camera(setup, state, &links, &features, camera, seed);
        }
        if before == (cameras.clone(), features.clone()) {
            break;
        }
    }
    missing_after(setup, &cameras, &features)
}

fn place_feature(
    setup: &Setup,
    state: &mut State,
    links: &[Vec<handeye_solvers::Pose>],
    cameras: &[bool],
    feature: usize,
) -> bool {
    let (mut poses, mut bearings) = (Vec::new(), Vec::new());
    let model = &state.model;
    let of_feature = |seen: &&Observation| seen.feature == feature && cameras[seen.camera] && state.placed[seen.sample];
    for seen in setup.observations.iter().filter(of_feature) {
        let camera = &model.cameras[seen.camera];
        if let Some(bearing) = camera.model.unproject(&camera.intrinsics, seen.pixel) {
            let carrier = model.carrier(model.features[feature].parent, &links[seen.sample]);
            let mount = model.carrier(camera.parent, &links[seen.sample]);
            poses.push((mount * camera.pose).inverse() * carrier);
            bearings.push(bearing);
        }
    }
    match triangulate(&poses, &bearings) {
        Some(xyz) => {
            state.model.features[feature].xyz = xyz;
            true
        }
        None => false,
    }
}

fn place_camera(
    setup: &Setup,
    state: &mut State,
    links: &[Vec<handeye_solvers::Pose>],
    features: &[bool],
    camera: usize,
    seed: u64,
) -> bool {
    let model = &state.model;
    let lens = model.cameras[camera];
    let (mut points, mut bearings): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = (Vec::new(), Vec::new());
    let of_camera = |seen: &&Observation| seen.camera == camera && features[seen.feature] && state.placed[seen.sample];
    for seen in setup.observations.iter().filter(of_camera) {
        if let Some(bearing) = lens.model.unproject(&lens.intrinsics, seen.pixel) {
            let feature = &model.features[seen.feature];
            let in_world = model.carrier(feature.parent, &links[seen.sample]).transform(&feature.xyz);
            points.push(model.carrier(lens.parent, &links[seen.sample]).inverse_transform(&in_world));
            bearings.push(bearing);
        }
    }
    let threshold = THRESHOLD_PX / lens.intrinsics[0] + 2.0 * setup.state_angle();
    match resect_robust(&points, &bearings, threshold, seed) {
        Some(found) if found.inliers.len() >= 6 => {
            state.model.cameras[camera].pose = found.camera_from_points.inverse();
            true
        }
        _ => false,
    }
}

fn missing_after(setup: &Setup, cameras: &[bool], features: &[bool]) -> Result<(), Error> {
    let seen = |camera: usize| setup.observations.iter().filter(|seen| seen.camera == camera).count();
    for (camera, placed) in cameras.iter().enumerate() {
        if !placed && seen(camera) == 0 && setup.rig.cameras[camera].pose.is_some() {
            continue;
        }
        if !placed {
            return Err(Error::NotEnoughData(format!(
                "nothing determines camera `{}`: it shares too few features with the others ({} detections in all)",
                setup.rig.cameras[camera].name,
                seen(camera)
            )));
        }
    }
    for (feature, placed) in features.iter().enumerate() {
        let count = setup.observations.iter().filter(|seen| seen.feature == feature).count();
        if !placed && (count > 0 || setup.rig.features[feature].xyz.is_none()) {
            return Err(Error::NotEnoughData(format!(
                "nothing determines feature `{}`: it is seen {count} time{}, and two views from different sides are needed",
                setup.rig.features[feature].name,
                if count == 1 { "" } else { "s" }
            )));
        }
    }
    Ok(())
}

/// Why no first look was possible: how much the cameras share, and which samples see too little.
pub(crate) fn what_is_missing(setup: &Setup) -> Error {
    let n_samples = setup.len();
    let mut counts = vec![vec![0_usize; setup.rig.cameras.len()]; n_samples];
    for seen in &setup.observations {
        counts[seen.sample][seen.camera] += 1;
    }
    let few: Vec<String> = counts
        .iter()
        .enumerate()
        .filter(|(_, cameras)| cameras.iter().all(|count| *count < 4))
        .map(|(sample, _)| setup.samples[sample].to_string())
        .collect();
    let shared: Vec<String> = (0..setup.rig.cameras.len())
        .flat_map(|a| (a + 1..setup.rig.cameras.len()).map(move |b| (a, b)))
        .map(|(a, b)| {
            let common: usize = counts.iter().map(|cameras| cameras[a].min(cameras[b])).sum();
            format!("`{}` and `{}` {common}", setup.rig.cameras[a].name, setup.rig.cameras[b].name)
        })
        .collect();
    let mut message = format!(
        "the images do not determine cameras and structure: {} samples, {} detections",
        n_samples,
        setup.observations.len()
    );
    if !shared.is_empty() {
        message += &format!("; at most shared by cameras, sample by sample: {}", shared.join(", "));
    }
    if !few.is_empty() {
        let some = few.iter().take(10).cloned().collect::<Vec<_>>().join(", ");
        message += &format!("; fewer than 4 features in every camera in {} samples ({some}, ...)", few.len());
    }
    Error::NotEnoughData(message)
}
