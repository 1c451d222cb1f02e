//! What to look at of all that was not said of the robot: joints that never move, whose names they are, and where the cameras are.
use super::words::list;
use handeye::calibrate::{Finding, Report};
use handeye::recording::Recording;
use handeye::rig::{Rig, catalog};

/// Joints that stand still, which are hardly the arm's.
pub fn still_joints(recording: &Recording) -> Option<String> {
    let still = recording.still_joints();
    let names = |is_still: bool| -> Vec<String> {
        let joints = recording.joints.iter().enumerate();
        joints.filter(|(joint, _)| still.contains(joint) == is_still).map(|(_, name)| name.clone()).collect()
    };
    let (still, moving) = (names(true), names(false));
    (!still.is_empty() && !moving.is_empty()).then(|| {
        format!(
            "joints that never move: {}; where they are not the arm's, as a gripper's are not, --joints {} leaves them out{}",
            list(&still),
            moving.join(","),
            known_names(recording).map_or_else(String::new, |names| format!("; {names}"))
        )
    })
}

/// What may be wrong where a fit is far off, for all that was not said: of any robot, and of where the cameras are.
pub fn hints(recording: &Recording, report: &Report, is_any_robot: bool, places_cameras: bool) -> Vec<String> {
    let is_misfit = |finding: &Finding| matches!(finding, Finding::Misfit { .. });
    if report.targets.is_some() || (report.converged && !report.findings.iter().any(is_misfit)) {
        return Vec::new();
    }
    let side = "cameras that no rig lists are taken to stand in the world: where they are on the hand, say --eye-in-hand (handeye check RIG REC \
                tries that and other mistakes)";
    let names = is_any_robot.then(|| known_names(recording)).flatten();
    (!places_cameras).then(|| side.to_owned()).into_iter().chain(names).collect()
}

/// The shipped rigs whose joints are called as those of the recording.
fn known_names(recording: &Recording) -> Option<String> {
    let shipped = shipped(recording);
    (!shipped.is_empty()).then(|| {
        format!(
            "its joints are called as those of shipped rigs ({}): if it is that robot, --rig gives its geometry",
            shipped.join(", ")
        )
    })
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
