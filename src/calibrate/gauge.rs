//! What pixels alone cannot tell, and the rules that fix it.
//!
//! Pixels do not change when the world moves with everything in it, when all lengths are scaled, when the tip's frame moves
//! against the features on it, or when the base turns about or slides along the first axis. Where nothing that is known
//! decides these, a rule does: values that would be redundant are held.
use super::deviations::{coordinate_of, intrinsics_of};
use super::graph::{Freedom, Priors, State, row};
use super::kinematics::PARALLEL;
use super::setup::Setup;
use crate::chain::{Convention, JointKind};
use crate::rig::{JointField, Parameter, Parent};
use handeye_solvers::Pose;

/// What is free in the last stage, and the rules that were needed, in words.
pub(crate) fn end_to_end(setup: &Setup, state: &mut State, priors: &Priors) -> (Freedom, Vec<String>) {
    let mut freedom = Freedom::all(setup, true);
    hold_fixed(setup, &mut freedom);
    let mut words = Vec::new();
    let rig = &setup.rig;
    let joints = &rig.robot.joints;
    if !freedom.base[0] && rig.robot.base.is_none() && !world_is_known(setup) {
        freedom.base = [true; 6];
        let base_from_world = state.model.base.inverse();
        move_world(state, &base_from_world);
        state.model.base = Pose::identity();
        words.push("the world frame is the robot's base: nothing that is known places the world".to_owned());
    }
    let unknown = |joint: usize, coordinate: usize| priors.parameters[row(joint) + coordinate].is_infinite();
    let names = ["offset", "d", "a", "alpha", "beta"];
    let last = joints.len() - 1;
    let hold = |joint: usize, coordinates: &[usize], why: &str, words: &mut Vec<String>, freedom: &mut Freedom| {
        let held: Vec<&str> = coordinates
            .iter()
            .filter(|&&coordinate| unknown(joint, coordinate) && !freedom.parameters[row(joint) + coordinate])
            .map(|&coordinate| names[coordinate])
            .collect();
        for &coordinate in coordinates.iter().filter(|&&coordinate| unknown(joint, coordinate)) {
            freedom.parameters[row(joint) + coordinate] = true;
        }
        if !held.is_empty() {
            words.push(format!("{} of joint `{}` is held: {why}", held.join(", "), joints[joint].name));
        }
    };
    let convention = rig.robot.convention;
    let (first_redundant, last_redundant) = ends(convention);
    let why = "the base can turn about and slide along the first axis";
    hold(0, first_redundant, why, &mut words, &mut freedom);
    if !tip_is_known(setup) {
        let why = "the tip's frame can move against what is fixed to it";
        hold(last, last_redundant, why, &mut words, &mut freedom);
    }
    for (joint, given) in joints.iter().enumerate().skip(1) {
        if given.kind == JointKind::Prismatic {
            let a_row = if convention == Convention::ModifiedDh { joint } else { joint - 1 };
            hold(joint - 1, &[1], "a sliding axis has a direction but no place", &mut words, &mut freedom);
            hold(a_row, &[2], "a sliding axis has a direction but no place", &mut words, &mut freedom);
        }
    }
    for joint in 0..joints.len() {
        // The row that holds the angle between the axes of this joint and the next.
        let twist = if convention == Convention::ModifiedDh { joint + 1 } else { joint };
        let parallel = joint < last && state.model.parameters[row(twist) + 3].sin().abs() < PARALLEL;
        // With a given d, the given rows stand as they are: a beta comes in only where the file has one.
        if parallel && unknown(joint, 1) && joints[twist].beta.is_none() && !is_alpha_fixed(setup, twist) {
            let why = "its axis is nearly parallel to the next, and beta stands in for d";
            hold(joint, &[1], why, &mut words, &mut freedom);
        } else if joint < last && joints[twist].beta.is_none() {
            freedom.parameters[row(twist) + 4] = true;
        }
    }
    let ends = if convention == Convention::ModifiedDh { 0 } else { last };
    freedom.parameters[row(ends) + 4] |= joints[ends].beta.is_none();
    if !length_is_known(setup) {
        let lengths = (0..joints.len()).flat_map(|joint| [row(joint) + 1, row(joint) + 2]);
        let size = |&index: &usize| state.model.parameters[index].abs();
        let longest = lengths.filter(|&index| !freedom.parameters[index]).max_by(|a, b| size(a).total_cmp(&size(b)));
        if let Some(longest) = longest {
            let unit = state.model.parameters[longest].abs();
            rescale(state, 1.0 / unit);
            freedom.parameters[longest] = true;
            let (joint, name) = (longest / row(1), names[longest % row(1)]);
            words.push(format!(
                "lengths are in units of {name} of joint `{}`: nothing that is known is metric",
                joints[joint].name
            ));
        }
    }
    (freedom, words)
}

/// The same with the frames of base and tip held against the first axis and against what is fixed to the tip.
pub(crate) fn with_frames_held(setup: &Setup, freedom: &Freedom) -> Freedom {
    let mut freedom = freedom.clone();
    let (first, last) = ends(setup.rig.robot.convention);
    for &coordinate in first {
        freedom.parameters[coordinate] = true;
    }
    if !tip_is_known(setup) {
        let joint = setup.rig.robot.joints.len() - 1;
        last.iter().for_each(|coordinate| freedom.parameters[row(joint) + coordinate] = true);
    }
    freedom
}

/// Numbers of the first row that the base's place makes redundant, and of the last that the tip's frame does.
fn ends(convention: Convention) -> (&'static [usize], &'static [usize]) {
    match convention {
        Convention::Dh => (&[0, 1], &[0, 1, 2, 3]),
        Convention::ModifiedDh => (&[0, 1, 2, 3], &[0, 1]),
    }
}

/// Holds what the rig says is held.
fn hold_fixed(setup: &Setup, freedom: &mut Freedom) {
    for parameter in setup.rig.parameters().into_iter().filter(|parameter| setup.rig.is_fixed(parameter)) {
        match parameter {
            Parameter::Base => freedom.base = [true; 6],
            Parameter::JointField { joint, field } => {
                let coordinate = coordinate_of(field);
                freedom.parameters[row(joint) + coordinate] = true;
                if field == JointField::Alpha && setup.rig.robot.joints[joint].beta.is_none() {
                    freedom.parameters[row(joint) + 4] = true;
                }
            }
            Parameter::CameraPose(camera) => freedom.cameras[camera] = [true; 6],
            Parameter::CameraField { camera, field } => {
                let distortion = setup.model.cameras[camera].model.distortion().len();
                freedom.intrinsics[camera][intrinsics_of(field, distortion)].fill(true);
            }
            Parameter::FeatureXyz(feature) => freedom.features[feature] = [true; 3],
        }
    }
}

fn is_alpha_fixed(setup: &Setup, joint: usize) -> bool {
    setup.rig.is_fixed(&Parameter::JointField { joint, field: JointField::Alpha })
}

/// Something given places the world: a camera in it, or a feature.
pub(crate) fn world_is_known(setup: &Setup) -> bool {
    let rig = &setup.rig;
    rig.cameras.iter().any(|camera| camera.parent == Parent::World && camera.pose.is_some())
        || rig.features.iter().any(|feature| feature.parent == Parent::World && feature.xyz.is_some())
}

/// Something given places the tip's frame: a camera on it, or a feature. Against an unknown chain they do not.
fn tip_is_known(setup: &Setup) -> bool {
    let rig = &setup.rig;
    let cameras = rig.cameras.iter().any(|camera| camera.parent == Parent::Tip && camera.pose.is_some());
    let features = rig.features.iter().any(|feature| feature.parent == Parent::Tip && feature.xyz.is_some());
    setup.chain_is_known() && (cameras || features)
}

/// Something given is a length: of a link, between cameras, between features, or the reading of a sliding joint.
pub(crate) fn length_is_known(setup: &Setup) -> bool {
    let rig = &setup.rig;
    let given = |value: Option<f64>| value.is_some_and(|value| value != 0.0);
    let of_parent = |parent: Parent| {
        let cameras = rig.cameras.iter().filter(|camera| camera.parent == parent && camera.pose.is_some());
        let features = rig.features.iter().filter(|feature| feature.parent == parent && feature.xyz.is_some());
        cameras.count() + features.count()
    };
    rig.robot.joints.iter().any(|joint| joint.kind == JointKind::Prismatic || given(joint.d) || given(joint.a))
        || of_parent(Parent::World) >= 2
        || of_parent(Parent::Tip) >= 2
}

/// Moves everything that is fixed to the world.
pub(crate) fn move_world(state: &mut State, new_from_old: &Pose) {
    state.model.base = *new_from_old * state.model.base;
    for camera in state.model.cameras.iter_mut().filter(|camera| camera.parent == Parent::World) {
        camera.pose = *new_from_old * camera.pose;
    }
    for feature in state.model.features.iter_mut().filter(|feature| feature.parent == Parent::World) {
        feature.xyz = new_from_old.transform(&feature.xyz);
    }
    for tip in &mut state.tips {
        *tip = *new_from_old * *tip;
    }
}

/// Multiplies every length.
pub(crate) fn rescale(state: &mut State, by: f64) {
    let model = &mut state.model;
    model.base.translation *= by;
    for joint in 0..model.chain.len() {
        model.parameters[row(joint) + 1] *= by;
        model.parameters[row(joint) + 2] *= by;
    }
    model.cameras.iter_mut().for_each(|camera| camera.pose.translation *= by);
    model.features.iter_mut().for_each(|feature| feature.xyz *= by);
    state.tips.iter_mut().for_each(|tip| tip.translation *= by);
}
