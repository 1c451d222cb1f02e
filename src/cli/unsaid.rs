//! What a recording that is learned from alone says of the robot: joints that never move, and whose names they are.
use super::words::list;
use handeye::recording::Recording;
use handeye::rig::{Rig, catalog};

/// Readings within this are of a joint that stands still [rad or m].
const UNMOVED: f64 = 1e-4;

/// Joints that stand still, which are hardly the arm's.
pub fn still_joints(recording: &Recording) -> Option<String> {
    let still = still(recording);
    let is_moving = |joint: &&String| !still.contains(joint);
    let moving: Vec<&str> = recording.joints.iter().filter(is_moving).map(String::as_str).collect();
    (!still.is_empty() && !moving.is_empty()).then(|| {
        format!(
            "joints that never move: {}; where they are not the arm's, as a gripper's are not, --joints {} leaves them out{}",
            list(&still),
            moving.join(","),
            known_names(recording).map_or_else(String::new, |names| format!("; {names}"))
        )
    })
}

/// The shipped rigs whose joints are called as those of the recording.
pub fn known_names(recording: &Recording) -> Option<String> {
    let shipped = shipped(recording);
    (!shipped.is_empty()).then(|| {
        format!(
            "its joints are called as those of shipped rigs ({}): if it is that robot, --rig gives its geometry",
            shipped.join(", ")
        )
    })
}

fn still(recording: &Recording) -> Vec<String> {
    let read = || recording.samples.iter().filter_map(|sample| sample.joints.as_ref());
    let range = |joint: usize| {
        let readings = read().map(|joints| joints[joint]);
        readings.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let is_still = |(low, high): (f64, f64)| high - low < UNMOVED;
    let joints = recording.joints.iter().enumerate();
    joints.filter(|(joint, _)| read().count() > 1 && is_still(range(*joint))).map(|(_, name)| name.clone()).collect()
}

/// Shipped rigs of which every joint's name is part of one of the recording's; the number of a joint alone tells nothing.
fn shipped(recording: &Recording) -> Vec<&'static str> {
    let is_part = |joint: &String| recording.joints.iter().any(|recorded| recorded.contains(joint.as_str()));
    let kind = |joint: &str| joint.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_').to_owned();
    let tells = |joint: &String| !["joint", "j"].contains(&kind(joint).as_str());
    let is_named_so = |rig: &Rig| {
        let joints = rig.robot.joint_names();
        joints.iter().all(|joint| tells(joint) && is_part(joint))
    };
    // Those with cameras are demonstrations.
    let is_arm = |rig: &Rig| rig.cameras.is_empty() && is_named_so(rig);
    let names = catalog::ALL.iter().map(|(name, _)| *name);
    names.filter(|name| catalog::rig(name).is_ok_and(|rig| is_arm(&rig))).collect()
}
