//! The view that can be turned: arm, cameras and features, where the rig puts them.
use super::page::Page;
use crate::Error;
use crate::calibrate::Placed;
use crate::recording::Recording;
use crate::rig::{Camera, Feature, Joint, Model, Parent, Rig, Target};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Arms that are drawn besides the first, tips at most, and arms that are shown one after the other.
const ARMS: usize = 8;
const TIPS: usize = 500;
const STATES: usize = 500;

/// Which arms are drawn.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shown<'a> {
    /// The first and a few others, spread over the samples.
    Few,
    /// One after the other: that of the moment which the page shows, with the features that are there then, in the world. There are at most
    /// [`thinned`] of them.
    Each(&'a [&'a [Vector3<f64>]]),
}

/// Every how many samples are shown where each of so many shall be.
pub(super) fn thinned(count: usize) -> usize {
    count.div_ceil(STATES).max(1)
}

/// Draws the arm in some samples, the tip in all.
pub(super) fn view(page: &mut Page, rig: &Rig, recording: &Recording, shown: Shown<'_>) -> Result<(), Error> {
    let rig = &drawn(rig);
    let model = Model::new(rig)?;
    let samples = &recording.samples;
    let of_sample = |sample: &crate::recording::Sample| {
        let joints = sample.joints.as_ref().filter(|joints| joints.len() == model.chain.len() && !joints.is_empty());
        let placed = joints.map(|joints| Placed::by_joints(&model, joints));
        placed.or_else(|| sample.pose.map(|pose| Placed::by_tip(&model, pose)))
    };
    let mut states: Vec<Placed> = samples.iter().filter_map(of_sample).collect();
    if states.is_empty() {
        states.push(Placed::by_joints(&model, &vec![0.0; model.chain.len()]));
    }
    let spread = |most: usize| (0..states.len()).step_by(states.len().div_ceil(most).max(1));
    let arms: Vec<usize> = match shown {
        Shown::Few => spread(ARMS + 1).collect(),
        Shown::Each(_) => (0..states.len()).step_by(thinned(states.len())).collect(),
    };
    let tip = |placed: &Placed| placed.links[placed.links.len() - 1].translation;
    let is_placed = |parent: Parent| states[0].knows(&model, parent);
    let features = |index: usize| -> Vec<Vector3<f64>> {
        if let Shown::Each(given) = shown {
            return given.get(index).map_or(Vec::new(), |features| features.to_vec());
        }
        let placed = model.features.iter().filter(|feature| is_placed(feature.parent));
        let links = &states[index].links;
        placed.map(|feature| model.carrier(feature.parent, links).transform(&feature.xyz)).collect()
    };
    let cameras = |state: &Placed| -> Vec<(usize, Pose)> {
        let placed = model.cameras.iter().enumerate().filter(|(_, camera)| is_placed(camera.parent));
        placed.map(|(index, camera)| (index, model.carrier(camera.parent, &state.links) * camera.pose)).collect()
    };
    let tips: Vec<Vector3<f64>> = spread(TIPS).map(|index| tip(&states[index])).collect();
    let (first_features, first_cameras) = (features(0), cameras(&states[0]));
    let all = || {
        tips.iter()
            .copied()
            .chain(first_features.iter().copied())
            .chain(first_cameras.iter().map(|(_, pose)| pose.translation))
            .chain([model.base.translation])
    };
    let count = all().count() as f64;
    let centre = all().sum::<Vector3<f64>>() / count;
    let radius = all().map(|point| (point - centre).norm()).fold(1e-9, f64::max);
    let axis = |k: usize| {
        let end = model.base.transform(&(Vector3::ith(k, 0.15 * radius)));
        json!([numbers(&model.base.translation), numbers(&end)])
    };
    // What the arm carries moves with it where arms follow each other.
    let moves = matches!(shown, Shown::Each(_));
    let carried = |is_carried: bool| if is_carried && moves { arms.clone() } else { vec![0] };
    let with_features = carried(true);
    let with_cameras = carried(model.cameras.iter().any(|camera| camera.parent != Parent::World));
    let frusta = |index: &usize| -> Value {
        let placed = cameras(&states[*index]);
        placed.iter().map(|(camera, pose)| frustum(rig, *camera, pose, 0.15 * radius)).collect()
    };
    let arm = |index: &usize| -> Value { states[*index].links.iter().map(|link| numbers(&link.translation)).collect() };
    let data = json!({
        "centre": numbers(&centre),
        "radius": radius,
        "moves": moves,
        "arms": arms.iter().map(arm).collect::<Vec<_>>(),
        "tips": tips.iter().map(numbers).collect::<Vec<_>>(),
        "features": with_features.iter().map(|index| features(*index).iter().map(numbers).collect()).collect::<Vec<Value>>(),
        "cameras": with_cameras.iter().map(frusta).collect::<Vec<_>>(),
        "axes": (0..3).map(axis).collect::<Vec<_>>(),
    });
    page.section("view-section", "Where everything is");
    page.view(
        &data.to_string(),
        match shown {
            Shown::Few => "drag to turn: the arm in its first sample and in others, the tip in all, features, cameras; axes at the base",
            Shown::Each(_) => "drag to turn: the arm at the moment shown above and at first, the way of the tip, features, cameras; axes at the base",
        },
    );
    Ok(())
}

/// What of a rig can be drawn: its targets as features, a camera whatever its lens, and an arm where its rows are known.
fn drawn(rig: &Rig) -> Rig {
    let mut drawn = rig.clone();
    let is_known = |joint: &Joint| [joint.offset, joint.d, joint.a, joint.alpha].iter().all(Option::is_some);
    if !drawn.robot.joints.iter().all(is_known) {
        drawn.robot.joints.clear();
    }
    let targets = rig.targets.iter().filter_map(|target| {
        let Target { name, parent, pose } = target.clone();
        Some(Feature { name, parent, xyz: Some(pose?.translation.into()) })
    });
    drawn.features.extend(targets);
    let has_arm = !drawn.robot.joints.is_empty();
    let is_placed = |parent: Parent| has_arm || !matches!(parent, Parent::Link(_));
    drawn.features.retain(|feature| feature.xyz.is_some() && is_placed(feature.parent));
    drawn.cameras.retain(|camera| camera.pose.is_some() && is_placed(camera.parent));
    let has_no_lens = |camera: &&mut Camera| [camera.fx, camera.fy, camera.cx, camera.cy].iter().any(Option::is_none);
    for camera in drawn.cameras.iter_mut().filter(has_no_lens) {
        *camera = Camera { depth: true, fx: None, fy: None, cx: None, cy: None, ..camera.clone() };
    }
    drawn
}

/// A camera's centre and its image at a distance.
fn frustum(rig: &Rig, index: usize, pose: &Pose, distance: f64) -> Value {
    let camera = &rig.cameras[index];
    let [width, height] = camera.size.unwrap_or([640, 480]).map(f64::from);
    let (fx, fy) = (camera.fx.unwrap_or(width), camera.fy.unwrap_or(width));
    let corner = |u: f64, v: f64| pose.transform(&(Vector3::new(u * width / fx, v * height / fy, 1.0) * distance));
    let corners = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
    let image: Vec<Value> = (0..5).map(|k| numbers(&corners[k % 4])).collect();
    let rays = corners.iter().map(|corner| json!([numbers(&pose.translation), numbers(corner)]));
    json!({ "name": camera.name, "lines": rays.chain([json!(image)]).collect::<Vec<_>>() })
}

/// To a tenth of a millimetre.
fn numbers(point: &Vector3<f64>) -> Value {
    json!(point.iter().map(|x| (x * 1e4).round() / 1e4).collect::<Vec<f64>>())
}
