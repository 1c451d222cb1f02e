//! How else data with pixels may have come about: each a rig and a recording with one mistake undone.
use super::{About, undo};
use crate::calibrate::{list_cameras, list_features};
use crate::chain::JointKind;
use crate::recording::Recording;
use crate::rig::{Parent, Rig};

/// How joints in degrees are called, and what to change.
pub(super) const DEGREES: (&str, &str) = ("joints are in degrees", "divide the readings of revolute joints by 57.2958");

/// The data with one mistake undone.
pub(super) struct Alternative {
    pub about: About,
    pub name: String,
    pub change: String,
    pub rig: Rig,
    pub recording: Recording,
}

/// The alternatives that apply.
pub(super) fn all(rig: &Rig, recording: &Recording) -> Vec<Alternative> {
    let as_recorded = |about: About, name: &str, change: &str| Alternative {
        about,
        name: name.to_owned(),
        change: change.to_owned(),
        rig: rig.clone(),
        recording: recording.clone(),
    };
    let has_joints = recording.samples.iter().any(|sample| sample.joints.is_some());
    let mut all = Vec::new();
    if has_joints {
        all.extend(units(rig, as_recorded));
    } else {
        for (about, name, change, undo) in undo::OF_POSES.into_iter().take(2) {
            let mut alternative = as_recorded(about, &format!("robot poses are {name}"), change);
            if name == "inverted" {
                // Pixels alone do not tell the two apart.
                alternative.change += ", or, if they are right, exchange the parents of cameras and features";
            }
            let poses = alternative.recording.samples.iter_mut().filter_map(|sample| sample.pose.as_mut());
            poses.for_each(|pose| *pose = undo(pose));
            all.push(alternative);
        }
    }
    let rows = if has_joints { "joints" } else { "robot poses" };
    for (name, change, rows) in undo::pairings(rows, recording.samples.len()) {
        all.push(Alternative {
            recording: undo::paired(recording, &rows),
            ..as_recorded(About::Order, &name, &change)
        });
    }
    // Joints from tip to base are nearly the same as the other side, which is the likelier mistake.
    let lists_none = rig.cameras.is_empty() && rig.features.is_empty();
    all.extend(other_side(rig, recording).map(|(rig, declared, parent)| {
        let name = format!("cameras that are declared {declared} move as if they were not");
        let other = if parent == "tip" { "world" } else { "tip" };
        let mut change =
            format!("set the parent of the cameras to \"{parent}\", and that of the features to \"{other}\"");
        if parent == "tip" && lists_none {
            change += ", or say --eye-in-hand";
        }
        Alternative { rig, ..as_recorded(About::Order, &name, &change) }
    }));
    for (name, change, order) in undo::joint_orders(rig, recording) {
        all.push(Alternative {
            recording: undo::reordered(recording, &order),
            ..as_recorded(About::Joints, &name, &change)
        });
    }
    all
}

fn units(rig: &Rig, as_recorded: impl Fn(About, &str, &str) -> Alternative) -> Vec<Alternative> {
    let kind = |joint: usize| rig.robot.joints.get(joint).map_or(JointKind::Revolute, |joint| joint.kind);
    let scaled = |mut alternative: Alternative, of: JointKind, factor: f64| {
        for joints in alternative.recording.samples.iter_mut().filter_map(|sample| sample.joints.as_mut()) {
            joints.iter_mut().enumerate().filter(|(i, _)| kind(*i) == of).for_each(|(_, reading)| *reading *= factor);
        }
        alternative
    };
    let degrees = as_recorded(About::Units, DEGREES.0, DEGREES.1);
    let mut all = vec![scaled(degrees, JointKind::Revolute, 1f64.to_radians())];
    if rig.robot.joints.iter().any(|joint| joint.kind == JointKind::Prismatic) {
        let lengths = as_recorded(
            About::Units,
            "prismatic joints are in millimetres",
            "divide the readings of prismatic joints by 1000",
        );
        all.push(scaled(lengths, JointKind::Prismatic, 1e-3));
    }
    all
}

/// The rig with cameras and features on the other side of the robot, what the cameras are declared to be, and what would do.
fn other_side(rig: &Rig, recording: &Recording) -> Option<(Rig, &'static str, &'static str)> {
    let mut other = rig.clone();
    list_cameras(&mut other, recording);
    list_features(&mut other, recording);
    let first = other.cameras.first()?.parent;
    let (declared, parent, to) = match first {
        Parent::World => ("in the world", "tip", Parent::Tip),
        Parent::Tip => ("on the tip", "world", Parent::World),
        Parent::Link(_) => return None,
    };
    if other.cameras.iter().any(|camera| camera.parent != first) {
        return None;
    }
    for camera in &mut other.cameras {
        (camera.parent, camera.pose) = (to, None);
    }
    for feature in other.features.iter_mut() {
        // Coordinates in the other frame are not known; the shape is learned again.
        (feature.parent, feature.xyz) = (first, None);
    }
    Some((other, declared, parent))
}
