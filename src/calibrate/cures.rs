//! What would determine a weak direction at the least expense: a length to measure, or joints to move further.
use super::deviations::Honest;
use super::direction::{Direction, per_step};
use super::graph::{Built, State};
use super::lengths;
use super::observation::Kind;
use crate::chain::JointKind;
use crate::rig::Model;
use std::f64::consts::PI;

/// A joint that moved over less than this says little of its own axis.
const LITTLE: f64 = PI / 6.0; // rad
const LITTLE_TRAVEL: f64 = 0.1; // m

/// A length that a ruler or a drawing gives is known to this, and is worth measuring where it is open by three times as much.
const RULER: f64 = 5e-4; // m

/// Moving a joint helps where the pixels then tell this many times as much of a direction, and as much as a prior does.
const GAIN: f64 = 4.0;

/// Samples that are looked at, spread evenly over the recording.
const SAMPLES: usize = 50;

/// In words; empty where neither helps.
pub(crate) fn cure(honest: &Honest<'_>, state: &State, built: &Built, direction: &Direction) -> String {
    let models = direction.both_ways(state, built);
    let joints = joints_to_move(honest, state, &models, direction.sd);
    if !joints.is_empty() {
        return motion(honest, state, &joints);
    }
    length(honest, &models, direction.sd).unwrap_or_default()
}

/// The distance between features that is least known along a direction.
fn length(honest: &Honest<'_>, [ahead, behind]: &[Model; 2], sd: Option<f64>) -> Option<String> {
    let (rig, sd) = (&honest.setup.rig, sd?);
    let mut best: Option<(f64, String)> = None;
    for (i, first) in rig.features.iter().enumerate() {
        for (k, second) in rig.features.iter().enumerate().skip(i + 1).filter(|(_, other)| other.parent == first.parent)
        {
            let between = |model: &Model| (model.features[i].xyz - model.features[k].xyz).norm();
            let change = (between(ahead) - between(behind)).abs() * per_step(sd);
            if change > best.as_ref().map_or(3.0 * RULER, |(most, _)| *most) {
                best = Some((change, format!("the distance between features `{}` and `{}`", first.name, second.name)));
            }
        }
    }
    let (change, what) = best?;
    if !lengths::tags(rig).is_empty() && rig.estimate.tag_side.is_none() {
        return Some("give the side of the tags whose corners the features are (`--tag-side METRES`)".to_owned());
    }
    Some(format!(
        "measure {what} (`--length`, or `[[estimate.lengths]]` in the rig file): it is known to {:.1} mm along this",
        1e3 * change
    ))
}

/// Joints that moved little, and of which the images would tell more of the direction had they moved further.
fn joints_to_move(honest: &Honest<'_>, state: &State, models: &[Model; 2], sd: Option<f64>) -> Vec<usize> {
    let setup = &honest.setup;
    if !setup.states.chain {
        return Vec::new();
    }
    let given = &setup.rig.robot.joints;
    let little = |joint: usize| if given[joint].kind == JointKind::Prismatic { LITTLE_TRAVEL } else { LITTLE };
    let now = seen(honest, state, models, None);
    let enough = (GAIN * now).max(sd.map_or(f64::MIN_POSITIVE, |sd| sd.powi(-2)));
    let helps = |&joint: &usize| {
        let (low, high) = range(state, joint);
        let further = |by: f64| seen(honest, state, models, Some((joint, by)));
        high - low < little(joint) && further(little(joint)).max(further(-little(joint))) > enough
    };
    (0..given.len()).filter(helps).collect()
}

/// Information of a direction in the recorded detections, with one joint displaced in all samples. Where
/// displaced features leave the image, the others stand for them.
fn seen(honest: &Honest<'_>, state: &State, [ahead, behind]: &[Model; 2], displaced: Option<(usize, f64)>) -> f64 {
    let setup = &honest.setup;
    let every = setup.len().div_ceil(SAMPLES).max(1);
    let (mut squares, mut count) = (0.0, 0);
    let (mut sample, mut links) = (usize::MAX, None);
    for seen in setup.observations.iter().filter(|seen| seen.sample % every == 0 && state.placed[seen.sample]) {
        if sample != seen.sample {
            sample = seen.sample;
            let mut joints = state.joints[sample].clone();
            if let Some((joint, by)) = displaced {
                joints[joint] += by;
            }
            links = Some([ahead.links(&joints), behind.links(&joints)]);
        }
        let Some([links_ahead, links_behind]) = &links else { continue };
        let point = ahead.in_camera(seen.camera, seen.feature, links_ahead);
        let (a, b) = (seen.predicted(ahead, links_ahead), seen.predicted(behind, links_behind));
        let size = setup.rig.cameras[seen.camera].size.filter(|_| seen.kind() == Kind::Pixels);
        let is_inside = size.is_none_or(|size| (0..2).all(|k| (0.0..f64::from(size[k])).contains(&a[k])));
        if ahead.cameras[seen.camera].model.is_in_front(&point) && is_inside {
            squares += ((a - b) / setup.sd(seen.kind())).norm_squared();
            count += 1;
        }
    }
    let of_one = squares / f64::from(count.max(1)) * per_step(1.0).powi(2);
    of_one * setup.observations.len() as f64
}

fn range(state: &State, joint: usize) -> (f64, f64) {
    let values = state.joints.iter().zip(&state.placed).filter(|(_, placed)| **placed).map(|(joints, _)| joints[joint]);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// "joints `yaw` and `pitch` moved only 14 and 6 degrees: move them over more than 30 degrees"
fn motion(honest: &Honest<'_>, state: &State, joints: &[usize]) -> String {
    let given = &honest.setup.rig.robot.joints;
    let of_kind = |kind: JointKind, unit: f64, little: f64, name: &str| {
        let joints: Vec<usize> = joints.iter().copied().filter(|&joint| given[joint].kind == kind).collect();
        let moved = joints.iter().map(|&joint| {
            let (low, high) = range(state, joint);
            format!("joint `{}` moved only {:.1} {name}", given[joint].name, unit * (high - low))
        });
        let names: Vec<String> = joints.iter().map(|&joint| format!("`{}`", given[joint].name)).collect();
        let cure = format!("move {} over more than {:.0} {name}", names.join(" and "), unit * little);
        (!joints.is_empty()).then(|| (moved.collect::<Vec<_>>(), cure))
    };
    let turning = of_kind(JointKind::Revolute, 180.0 / PI, LITTLE, "degrees");
    let sliding = of_kind(JointKind::Prismatic, 1e3, LITTLE_TRAVEL, "mm");
    let (moved, cures): (Vec<_>, Vec<_>) = turning.into_iter().chain(sliding).unzip();
    format!("{}: {}", moved.concat().join(", "), cures.join(", "))
}
