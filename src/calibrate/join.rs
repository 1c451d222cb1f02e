//! Brings in what the first look could not place, and says what is missing where that is not possible.
use super::evaluate::median;
use super::graph::State;
use super::observation::Observation;
use super::setup::Setup;
use crate::Error;
use crate::geometry::{align_robust, resect_robust, triangulate};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Largest error of a good bearing while joining [px].
const THRESHOLD_PX: f64 = 6.0;

/// Points that place a depth camera: three determine its pose, the fourth says whether it is right.
const POINTS: usize = 4;

/// Places every camera among the known features by alignment or resection and every feature by its points or triangulation, in
/// turns, until nothing is left or nothing more can be placed.
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

fn place_feature(setup: &Setup, state: &mut State, links: &[Vec<Pose>], cameras: &[bool], feature: usize) -> bool {
    let (mut poses, mut bearings, mut places) = (Vec::new(), Vec::new(), Vec::new());
    let model = &state.model;
    let of_feature = |seen: &&Observation| seen.feature == feature && cameras[seen.camera] && state.placed[seen.sample];
    for seen in setup.observations.iter().filter(of_feature) {
        let camera = &model.cameras[seen.camera];
        if let Some(bearing) = seen.bearing(model) {
            let carrier = model.carrier(model.features[feature].parent, &links[seen.sample]);
            let mount = model.carrier(camera.parent, &links[seen.sample]);
            let camera_from_carrier = (mount * camera.pose).inverse() * carrier;
            places.extend(seen.point().map(|point| camera_from_carrier.inverse_transform(&point)));
            poses.push(camera_from_carrier);
            bearings.push(bearing);
        }
    }
    match middle(&places).or_else(|| triangulate(&poses, &bearings)) {
        Some(xyz) => {
            state.model.features[feature].xyz = xyz;
            true
        }
        None => false,
    }
}

/// The median of each coordinate; `None` of nothing.
fn middle(places: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let coordinate = |k: usize| median(&mut places.iter().map(|place| place[k]).collect::<Vec<_>>());
    (!places.is_empty()).then(|| Vector3::from_fn(|k, _| coordinate(k)))
}

fn place_camera(
    setup: &Setup,
    state: &mut State,
    links: &[Vec<Pose>],
    features: &[bool],
    camera: usize,
    seed: u64,
) -> bool {
    let model = &state.model;
    let lens = model.cameras[camera];
    let (mut points, mut bearings): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = (Vec::new(), Vec::new());
    let (mut in_mount, mut in_camera) = (Vec::new(), Vec::new());
    let of_camera = |seen: &&Observation| seen.camera == camera && features[seen.feature] && state.placed[seen.sample];
    for seen in setup.observations.iter().filter(of_camera) {
        let feature = &model.features[seen.feature];
        let in_world = model.carrier(feature.parent, &links[seen.sample]).transform(&feature.xyz);
        let point = model.carrier(lens.parent, &links[seen.sample]).inverse_transform(&in_world);
        if let Some(measured) = seen.point() {
            in_mount.push(point);
            in_camera.push(measured);
        } else if let Some(bearing) = seen.bearing(model) {
            points.push(point);
            bearings.push(bearing);
        }
    }
    if in_camera.len() >= POINTS
        && let Some(pose) = align_robust(&in_camera, &in_mount, seed)
    {
        state.model.cameras[camera].pose = pose;
        return true;
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
