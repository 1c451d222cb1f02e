//! What pixels alone cannot tell, and the rules that fix it.
//!
//! Pixels do not change when the world moves with everything in it, when all lengths are scaled, when the tip's frame moves
//! against the features on it, or when the base turns about or slides along the first axis. Where nothing that is known
//! decides these, a rule does: values that would be redundant are held. Points of depth cameras decide the scale.
use super::deviations::{coordinate_of, intrinsics_of};
use super::graph::{Freedom, Priors, State, row};
use super::lengths;
use super::observation::Kind;
use super::setup::Setup;
use crate::chain::{Convention, JointKind, LINK_PARAMETERS, PARALLEL};
use crate::rig::{JointField, Parameter, Parent};
use handeye_solvers::Pose;

/// What is free in the last stage, and the rules that were needed, in words.
pub(crate) fn end_to_end(setup: &Setup, state: &mut State, priors: &Priors) -> (Freedom, Vec<String>) {
    let mut rules = Rules { setup, priors, freedom: Freedom::all(setup), words: Vec::new() };
    hold_fixed(setup, &mut rules.freedom);
    if !setup.states.chain {
        rules.freedom.base = [true; 6];
        rules.freedom.parameters.fill(true);
        return (rules.freedom, rules.words);
    }
    rules.world(state);
    rules.first_and_last_row();
    rules.sliding_axes();
    rules.parallel_axes(state);
    rules.scale(state);
    (rules.freedom, rules.words)
}

/// The rules so far.
struct Rules<'a> {
    setup: &'a Setup,
    priors: &'a Priors,
    freedom: Freedom,
    words: Vec<String>,
}

/// A joint's numbers, in order.
const NAMES: [&str; LINK_PARAMETERS] = ["offset", "d", "a", "alpha", "beta"];

impl Rules<'_> {
    fn world(&mut self, state: &mut State) {
        if self.freedom.base[0] || self.setup.rig.robot.base.is_some() || world_is_known(self.setup) {
            return;
        }
        self.freedom.base = [true; 6];
        let base_from_world = state.model.base.inverse();
        move_world(state, &base_from_world);
        state.model.base = Pose::identity();
        self.words.push("the world frame is the robot's base: nothing that is known places the world".to_owned());
    }

    fn first_and_last_row(&mut self) {
        let (first, last) = ends(self.setup.rig.robot.convention);
        self.hold(0, first, "the base can turn about and slide along the first axis");
        if !tip_is_known(self.setup) {
            self.hold(self.last(), last, "the tip's frame can move against what is fixed to it");
        }
    }

    fn sliding_axes(&mut self) {
        for (joint, given) in self.setup.rig.robot.joints.iter().enumerate().skip(1) {
            if given.kind == JointKind::Prismatic {
                let why = "a sliding axis has a direction but no place";
                self.hold(joint - 1, &[1], why);
                self.hold(self.twist(joint - 1), &[2], why);
            }
        }
    }

    /// Between nearly parallel axes, the place of the common normal along the first is ill-defined: beta stands in for d.
    fn parallel_axes(&mut self, state: &State) {
        let joints = &self.setup.rig.robot.joints;
        for joint in 0..self.last() {
            let twist = self.twist(joint);
            if joints[twist].beta.is_some() {
                continue;
            }
            let parallel = state.model.parameters[row(twist) + 3].sin().abs() < PARALLEL;
            // With a given d, the given rows stand as they are: a beta comes in only where the file has one.
            if parallel && self.is_unknown(joint, 1) && !is_alpha_fixed(self.setup, twist) {
                self.hold(joint, &[1], "its axis is nearly parallel to the next, and beta stands in for d");
            } else {
                self.freedom.parameters[row(twist) + 4] = true;
            }
        }
        // The row that no two axes share.
        let end = if self.setup.rig.robot.convention == Convention::ModifiedDh { 0 } else { self.last() };
        self.freedom.parameters[row(end) + 4] |= joints[end].beta.is_none();
    }

    fn scale(&mut self, state: &mut State) {
        if length_is_given(self.setup) {
            return;
        }
        if let Some(by) = lengths::scale(self.setup, state) {
            rescale(state, by);
            return;
        }
        let joints = &self.setup.rig.robot.joints;
        let lengths = (0..joints.len()).flat_map(|joint| [row(joint) + 1, row(joint) + 2]);
        let size = |&index: &usize| state.model.parameters[index].abs();
        let free = lengths.filter(|&index| !self.freedom.parameters[index]);
        let Some(longest) = free.max_by(|a, b| size(a).total_cmp(&size(b))) else { return };
        let unit = state.model.parameters[longest].abs();
        rescale(state, 1.0 / unit);
        self.freedom.parameters[longest] = true;
        let (joint, name) = (longest / LINK_PARAMETERS, NAMES[longest % LINK_PARAMETERS]);
        self.words.push(format!(
            "lengths are in units of {name} of joint `{}`: nothing that is known is metric (one `--length` or a `--tag-side` would do)",
            joints[joint].name
        ));
    }

    /// Holds those of a joint's numbers of which nothing is known.
    fn hold(&mut self, joint: usize, coordinates: &[usize], why: &str) {
        let mut names = Vec::new();
        for &coordinate in coordinates {
            if !self.is_unknown(joint, coordinate) {
                continue;
            }
            let held = &mut self.freedom.parameters[row(joint) + coordinate];
            if !std::mem::replace(held, true) {
                names.push(NAMES[coordinate]);
            }
        }
        if !names.is_empty() {
            let name = &self.setup.rig.robot.joints[joint].name;
            self.words.push(format!("{} of joint `{name}` is held: {why}", names.join(", ")));
        }
    }

    fn is_unknown(&self, joint: usize, coordinate: usize) -> bool {
        self.priors.parameters[row(joint) + coordinate].is_infinite()
    }

    fn last(&self) -> usize {
        self.setup.rig.robot.joints.len() - 1
    }

    /// The row that holds a, alpha and beta between the axes of this joint and the next.
    fn twist(&self, joint: usize) -> usize {
        if self.setup.rig.robot.convention == Convention::ModifiedDh { joint + 1 } else { joint }
    }
}

/// The same with the frames of base and tip held against the first axis and against what is fixed to the tip.
pub(crate) fn with_frames_held(setup: &Setup, freedom: &Freedom) -> Freedom {
    let mut freedom = freedom.clone();
    if !setup.states.chain {
        return freedom;
    }
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

/// True where the tip follows from something that is free: not where the whole chain is held, and not where tips are read.
pub(crate) fn is_tip_learned(setup: &Setup, freedom: &Freedom) -> bool {
    let is_free = |held: &bool| !held;
    setup.states.chain && (freedom.base.iter().any(is_free) || freedom.parameters.iter().any(is_free))
}

/// Numbers of the first row that the base's place makes redundant, and of the last that the tip's frame does.
pub(crate) fn ends(convention: Convention) -> (&'static [usize], &'static [usize]) {
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
            Parameter::TargetPose(_) => {}
        }
    }
}

fn is_alpha_fixed(setup: &Setup, joint: usize) -> bool {
    setup.rig.is_fixed(&Parameter::JointField { joint, field: JointField::Alpha })
}

/// Something given places the world: a camera in it, or a feature.
pub(crate) fn world_is_known(setup: &Setup) -> bool {
    let rig = &setup.rig;
    setup.states.poses_beside_joints()
        || rig.cameras.iter().any(|camera| camera.parent == Parent::World && camera.pose.is_some())
        || rig.features.iter().any(|feature| feature.parent == Parent::World && feature.xyz.is_some())
}

/// Something given places the tip's frame: a camera on it, or a feature. Against an unknown chain they do not.
fn tip_is_known(setup: &Setup) -> bool {
    let rig = &setup.rig;
    let cameras = rig.cameras.iter().any(|camera| camera.parent == Parent::Tip && camera.pose.is_some());
    let features = rig.features.iter().any(|feature| feature.parent == Parent::Tip && feature.xyz.is_some());
    setup.chain_is_known() && (cameras || features)
}

/// Something is a length: a given one, or one that was measured.
pub(crate) fn length_is_known(setup: &Setup) -> bool {
    length_is_given(setup) || !setup.lengths.is_empty()
}

/// Something given is a length: of a link, between cameras, between features, the reading of a sliding joint, or where a depth
/// camera saw something.
fn length_is_given(setup: &Setup) -> bool {
    let rig = &setup.rig;
    let given = |value: Option<f64>| value.is_some_and(|value| value != 0.0);
    let of_parent = |parent: Parent| {
        let cameras = rig.cameras.iter().filter(|camera| camera.parent == parent && camera.pose.is_some());
        let features = rig.features.iter().filter(|feature| feature.parent == parent && feature.xyz.is_some());
        cameras.count() + features.count()
    };
    !setup.states.chain
        || setup.states.poses_beside_joints()
        || setup.has(Kind::Points)
        || rig.robot.joints.iter().any(|joint| joint.kind == JointKind::Prismatic || given(joint.d) || given(joint.a))
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
