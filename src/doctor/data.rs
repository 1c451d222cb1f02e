//! What the samples themselves show, without a model.
use super::{About, Finding};
use crate::chain::JointKind;
use crate::recording::{Recording, Sample, is_in_another_order};
use crate::rig::Rig;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// Share of samples that may repeat an earlier one before it is worth saying.
const REPEATED: f64 = 0.2;

/// A tip that turns by less than this [rad, rms] about every axis but one determines little.
const TURN: f64 = 0.05;

/// Turns below this [rad, rms] may be the noise of arms and trackers.
const NOISE: f64 = 0.01;

/// No arm reaches so far, and no target is so far away [m].
const FAR: f64 = 20.0;

/// Everything that needs no solve. `tips`: `world_from_tip` of each sample, where it is known.
pub(super) fn findings(rig: &Rig, recording: &Recording, tips: &[Option<Pose>]) -> Vec<Finding> {
    let mut findings = outside_limits(rig, recording);
    findings.extend(repeats(recording));
    findings.extend(one_joint(recording).or_else(|| one_axis(tips)));
    findings.extend(distances(rig, recording));
    findings
}

/// Joints that have the names of the rig's in another order: they go by their places, so nothing that a fit says would hold.
pub(super) fn another_order(rig: &Rig, recording: &Recording) -> Option<Finding> {
    let names = rig.robot.joint_names();
    is_in_another_order(&recording.joints, &names).then(|| Finding {
        about: About::Order,
        what: format!("the joints are in the order {}, those of the rig in another", recording.joints.join(", ")),
        change: format!("put the readings in the rig's order, {}, or read the file with the rig", names.join(", ")),
    })
}

/// Readings that the rig's robot could not have had.
fn outside_limits(rig: &Rig, recording: &Recording) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (index, joint) in rig.robot.joints.iter().enumerate() {
        let read = recording.samples.iter().filter_map(|sample| sample.joints.as_ref()?.get(index).copied());
        let read: Vec<f64> = read.collect();
        let [lower, upper] =
            [joint.limits.lower.unwrap_or(f64::NEG_INFINITY), joint.limits.upper.unwrap_or(f64::INFINITY)];
        let n = read.iter().filter(|reading| joint.limits.exclude(**reading)).count();
        if n > 0 {
            findings.push(Finding {
                about: About::Limits,
                what: format!(
                    "{n} of {} readings of joint `{}` are outside the rig's limits, {lower:.3} to {upper:.3}",
                    read.len(),
                    joint.name
                ),
                change: "is it this robot? Take its rig, or correct the limits, or the readings' unit, zero or order"
                    .into(),
            });
        }
    }
    findings
}

/// Samples whose joints or poses were read before, to the last bit, where they are many.
pub(crate) fn repeats(recording: &Recording) -> Option<Finding> {
    let mut known = BTreeSet::new();
    let (mut n, mut repeats) = (0_u32, 0_u32);
    for Sample { joints, pose, .. } in &recording.samples {
        if joints.is_none() && pose.is_none() {
            continue;
        }
        let of_pose = pose.iter().flat_map(|pose| pose.rotation.iter().chain(&pose.translation));
        let numbers = joints.iter().flatten().chain(of_pose).map(|number| number.to_bits());
        n += 1;
        repeats += u32::from(!known.insert((joints.is_some(), numbers.collect::<Vec<u64>>())));
    }
    (f64::from(repeats) > REPEATED * f64::from(n)).then(|| Finding {
        about: About::Order,
        what: format!("{repeats} of {n} samples repeat the robot's state of an earlier one"),
        change: match recording.pauses() {
            Some(pauses) => format!("take one sample of each of the {pauses} pauses of the robot: --still does"),
            None => "record more varied positions".into(),
        },
    })
}

fn one_joint(recording: &Recording) -> Option<Finding> {
    let read = recording.samples.iter().filter(|sample| sample.joints.is_some()).count();
    let still = recording.still_joints();
    let moving: Vec<&String> =
        recording.joints.iter().enumerate().filter(|(joint, _)| !still.contains(joint)).map(|(_, name)| name).collect();
    let what = match moving[..] {
        _ if read < 2 || recording.joints.len() < 2 => return None,
        [] => "no joint moves".to_owned(),
        [joint] => format!("only joint {joint} moves"),
        _ => return None,
    };
    Some(Finding { about: About::Turns, what, change: "record positions in which all joints differ".into() })
}

/// All rotations about one axis leave the positions along it open.
pub(super) fn one_axis(tips: &[Option<Pose>]) -> Option<Finding> {
    let tips: Vec<Pose> = tips.iter().flatten().copied().collect();
    let n = tips.len();
    if n < 3 {
        return None;
    }
    let mut spread = Matrix3::zeros();
    for i in 0..n {
        let turn = so3::log(&(tips[i].rotation.transpose() * tips[(i + n / 3 + 1) % n].rotation));
        spread += turn * turn.transpose() / n as f64;
    }
    let eigen = spread.try_symmetric_eigen(f64::EPSILON, 200)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let rms = |k: usize| eigen.eigenvalues[order[k]].max(0.0).sqrt();
    let axis: Vector3<f64> = eigen.eigenvectors.column(order[0]).into_owned();
    let axis = axis * axis[axis.iamax()].signum();
    let direction = format!("({:.3}, {:.3}, {:.3})", axis.x, axis.y, axis.z);
    let what = match (rms(0), rms(1)) {
        (_, second) if second > TURN => return None,
        (first, _) if first < NOISE => "the tip does not turn".to_owned(),
        (first, _) if first < TURN => format!("the tip hardly turns: by {:.1}° rms at most", first.to_degrees()),
        (_, second) if second < NOISE => format!("all rotations are about one axis of the tip: {direction}"),
        (first, second) => format!(
            "the tip turns by {:.1}° rms about {direction} and by {:.1}° at most about the axes across it: nearly about one axis",
            first.to_degrees(),
            second.to_degrees()
        ),
    };
    let change = "record positions that turn about another axis too, by 30 degrees or more".into();
    Some(Finding { about: About::Turns, what, change })
}

/// Lengths that only millimetres would explain.
fn distances(rig: &Rig, recording: &Recording) -> Vec<Finding> {
    let far = |mut lengths: Vec<f64>| !lengths.is_empty() && crate::calibrate::median(&mut lengths) > FAR;
    let samples = &recording.samples;
    let mut findings = Vec::new();
    let mut add = |what: &str, change: &str| {
        findings.push(Finding { about: About::Units, what: what.into(), change: change.into() });
    };
    let positions = "divide their positions by 1000";
    if far(samples.iter().filter_map(|sample| sample.pose).map(|pose| pose.translation.norm()).collect()) {
        add("robot poses are in millimetres", positions);
    }
    if far(samples.iter().flat_map(|sample| &sample.targets).map(|seen| seen.pose.translation.norm()).collect()) {
        add("target poses are in millimetres", positions);
    }
    if far(samples.iter().flat_map(|sample| &sample.points).map(|seen| Vector3::from(seen.point).norm()).collect()) {
        add("points of depth cameras are in millimetres", "divide them by 1000");
    }
    for (index, joint) in rig.robot.joints.iter().enumerate().filter(|(_, joint)| joint.kind == JointKind::Prismatic) {
        let read: Vec<f64> = samples.iter().filter_map(|s| Some(s.joints.as_ref()?.get(index)?.abs())).collect();
        if far(read) {
            findings.push(Finding {
                about: About::Units,
                what: format!("prismatic joint {} is in millimetres", joint.name),
                change: "divide its readings by 1000".into(),
            });
        }
    }
    findings
}
