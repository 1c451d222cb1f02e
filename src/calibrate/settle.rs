//! Puts a learned chain, cameras and features where given values say that they are.
//!
//! What was learned from nothing is known up to a similarity of space, and each frame of the chain up to half a turn about
//! its z (which turns the signs of a and alpha). Given values decide both before the last stages begin.
use super::anchor::Anchor;
use super::evaluate::median;
use super::gauge::{move_world, rescale};
use super::graph::{State, row};
use super::observation::Kind;
use super::setup::Setup;
use crate::chain::{Convention, JointKind, LINK_PARAMETERS};
use crate::geometry::{align, nearest_rotation};
use crate::rig::{Joint, Parameter, Parent};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Of the choice of samples among which wrong poses are told from right ones.
const SEED: u64 = 1;

/// Moves everything that was learned to where given cameras, features and rows are, and takes given values over where they
/// are held.
pub(crate) fn settle(setup: &Setup, state: &mut State) {
    if !setup.chain_is_known() {
        if let Some(scale) = given_scale(setup, state) {
            rescale(state, scale);
        }
        take_signs(setup, state);
        take_ends(setup, state);
    }
    if !setup.states.chain {
        // The world and its unit are those of the tip poses.
    } else if let Some(given_from_learned) = given_world(setup, state) {
        move_world(state, &given_from_learned);
    } else if let (Some(base), false) = (setup.rig.robot.base, setup.chain_is_known()) {
        move_world(state, &(base * state.model.base.inverse()));
    }
    take_poses(setup, state);
    hold_given(setup, state);
}

/// Moves the world, and scales what is learned, to where tip poses beside the joints say that the tip is.
fn take_poses(setup: &Setup, state: &mut State) {
    if !setup.states.poses_beside_joints() {
        return;
    }
    let read: Vec<(Pose, Pose)> = (0..setup.len())
        .filter(|&sample| state.placed[sample])
        .filter_map(|sample| Some((state.model.tip(&state.joints[sample]), setup.states.poses[sample]?)))
        .collect();
    let (learned, read): (Vec<Pose>, Vec<Pose>) = read.into_iter().unzip();
    let Some(anchor) = Anchor::find(&learned, &read, SEED) else { return };
    if setup.tool_is_open() {
        rescale(state, 1.0 / anchor.scale);
        state.tool = anchor.tip.inverse();
    }
    let world = Pose { translation: anchor.world.translation / anchor.scale, ..anchor.world };
    move_world(state, &world.inverse());
}

/// What lengths must be multiplied by: in the median over link lengths, and over distances between cameras and between
/// features that are fixed to the same.
fn given_scale(setup: &Setup, state: &State) -> Option<f64> {
    let mut ratios = Vec::new();
    for (index, joint) in setup.rig.robot.joints.iter().enumerate() {
        for (given, learned) in [(joint.d, row(index) + 1), (joint.a, row(index) + 2)] {
            let learned = state.model.parameters[learned].abs();
            ratios
                .extend(given.map(f64::abs).filter(|given| *given > 0.0 && learned > 0.0).map(|given| given / learned));
        }
    }
    // A sliding joint or a depth camera has set the unit already.
    if setup.has(Kind::Points) || setup.rig.robot.joints.iter().any(|joint| joint.kind == JointKind::Prismatic) {
        return None;
    }
    let mut groups: Vec<Vec<(Vector3<f64>, Vector3<f64>)>> = Vec::new();
    for parent in [Parent::World, Parent::Tip] {
        groups.push(given_points(setup, state, parent, true));
        groups.push(given_points(setup, state, parent, false));
    }
    for group in groups {
        for (i, a) in group.iter().enumerate() {
            for b in &group[..i] {
                let (given, learned) = ((a.0 - b.0).norm(), (a.1 - b.1).norm());
                ratios.extend((given > 0.0 && learned > 0.0).then(|| given / learned));
            }
        }
    }
    (!ratios.is_empty()).then(|| median(&mut ratios))
}

/// (given, learned) places of the cameras, or of the features, that are fixed to one parent.
fn given_points(setup: &Setup, state: &State, parent: Parent, cameras: bool) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let rig = &setup.rig;
    if cameras {
        let both = rig.cameras.iter().zip(&state.model.cameras).filter(|(given, _)| given.parent == parent);
        both.filter_map(|(given, learned)| Some((given.pose?.translation, learned.pose.translation))).collect()
    } else {
        let both = rig.features.iter().zip(&state.model.features).filter(|(given, _)| given.parent == parent);
        both.filter_map(|(given, learned)| Some((Vector3::from(given.xyz?), learned.xyz))).collect()
    }
}

/// The motion of space that takes learned cameras and features of the world to the given ones.
fn given_world(setup: &Setup, state: &State) -> Option<Pose> {
    let features = given_points(setup, state, Parent::World, false);
    let cameras = setup.rig.cameras.iter().zip(&state.model.cameras).filter(|(given, _)| given.parent == Parent::World);
    let poses: Vec<(Pose, Pose)> = cameras.filter_map(|(given, learned)| Some((given.pose?, learned.pose))).collect();
    if poses.is_empty() {
        let (to, from): (Vec<_>, Vec<_>) = features.into_iter().unzip();
        return align(&from, &to);
    }
    let turned: Matrix3<f64> = poses.iter().map(|(given, learned)| given.rotation * learned.rotation.transpose()).sum();
    let rotation = nearest_rotation(&turned)?;
    let shifts = poses.iter().map(|(given, learned)| given.translation - rotation * learned.translation);
    let translation = shifts.sum::<Vector3<f64>>() / poses.len() as f64;
    Some(Pose { rotation, translation })
}

/// Turns frames by half a turn about their z where given values of a or alpha have the other sign:
/// Rz(θ + π) Tz(d) Tx(-a) Rx(-α) Ry(-β) = Rz(θ) Tz(d) Tx(a) Rx(α) Ry(β) Rz(π).
fn take_signs(setup: &Setup, state: &mut State) {
    let joints = &setup.rig.robot.joints;
    let last = joints.len() - 1;
    let modified = setup.rig.robot.convention == Convention::ModifiedDh;
    for joint in 0..last {
        // The row that holds a and alpha between the axes of this joint and the next.
        let twist = if modified { joint + 1 } else { joint };
        let learned = |k: usize| state.model.parameters[row(twist) + k];
        let against = |given: Option<f64>, learned: f64| given.map_or(0.0, |given| given * learned);
        let agreement =
            against(joints[twist].a, learned(2)) + against(joints[twist].alpha.map(f64::sin), learned(3).sin());
        if agreement >= 0.0 {
            continue;
        }
        for k in 2..LINK_PARAMETERS {
            state.model.parameters[row(twist) + k] *= -1.0;
        }
        turn_about_z(state, joint, PI);
        state.model.parameters[row(joint + 1)] -= PI;
    }
    if last > 0 && state.model.parameters[row(last)] != 0.0 {
        take_offset_of_last(state, last);
    }
}

/// Adds to the offset of a joint; the first joint's belongs to the base.
fn turn_about_z(state: &mut State, joint: usize, angle: f64) {
    if joint == 0 {
        let turn = Pose::new(Vector3::new(0.0, 0.0, angle), Vector3::zeros());
        state.model.base = state.model.base * turn;
    } else {
        state.model.parameters[row(joint)] += angle;
    }
}

/// Gives the last joint's offset to what is fixed to the tip.
fn take_offset_of_last(state: &mut State, last: usize) {
    let turn = Pose::new(Vector3::new(0.0, 0.0, state.model.parameters[row(last)]), Vector3::zeros());
    state.model.parameters[row(last)] = 0.0;
    move_tip(state, &turn);
}

/// Gives the base what the first row's given offset and d take from it, and the features what the last row's do.
fn take_ends(setup: &Setup, state: &mut State) {
    let joints = &setup.rig.robot.joints;
    let convention = setup.rig.robot.convention;
    let kinds = &setup.model.chain.kinds;
    let last = joints.len() - 1;
    let given =
        |joint: &Joint| [joint.offset, joint.d, joint.a, joint.alpha, joint.beta].map(|value| value.unwrap_or(0.0));
    let link = |joint: usize, values: [f64; LINK_PARAMETERS]| convention.link(kinds[joint], &values, 0.0);
    if last == 0 {
        return;
    }
    let [offset, d, ..] = given(&joints[0]);
    let first = link(0, [offset, d, 0.0, 0.0, 0.0]);
    state.model.base = state.model.base * first.inverse();
    state.model.parameters[..2].copy_from_slice(&[offset, d]);
    let [offset, d, a, alpha, beta] = given(&joints[last]);
    let end =
        if convention == Convention::ModifiedDh { [offset, d, 0.0, 0.0, 0.0] } else { [offset, d, a, alpha, beta] };
    move_tip(state, &link(last, end).inverse());
    let held = if convention == Convention::ModifiedDh { 2 } else { LINK_PARAMETERS };
    state.model.parameters[row(last)..row(last) + held].copy_from_slice(&end[..held]);
}

/// Moves what is fixed to the tip.
fn move_tip(state: &mut State, new_from_old: &Pose) {
    for feature in state.model.features.iter_mut().filter(|feature| feature.parent == Parent::Tip) {
        feature.xyz = new_from_old.transform(&feature.xyz);
    }
    for camera in state.model.cameras.iter_mut().filter(|camera| camera.parent == Parent::Tip) {
        camera.pose = *new_from_old * camera.pose;
    }
}

/// Takes over what is held.
fn hold_given(setup: &Setup, state: &mut State) {
    let (given, model) = (&setup.model, &mut state.model);
    for parameter in setup.rig.parameters().into_iter().filter(|parameter| setup.rig.is_fixed(parameter)) {
        match parameter {
            Parameter::Base => model.base = given.base,
            Parameter::JointField { joint, field } => {
                let at = row(joint) + super::deviations::coordinate_of(field);
                model.parameters[at] = given.parameters[at];
            }
            Parameter::CameraPose(camera) => model.cameras[camera].pose = given.cameras[camera].pose,
            Parameter::CameraField { camera, field } => {
                let distortion = given.cameras[camera].model.distortion().len();
                let range = super::deviations::intrinsics_of(field, distortion);
                model.cameras[camera].intrinsics[range.clone()]
                    .copy_from_slice(&given.cameras[camera].intrinsics[range]);
            }
            Parameter::FeatureXyz(feature) => model.features[feature].xyz = given.features[feature].xyz,
            Parameter::TargetPose(_) => {}
        }
    }
}
