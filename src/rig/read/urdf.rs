//! A `[robot]` that a URDF describes: `urdf`, the links `base` and `tip`, and the base's pose in the world.
use super::document::{Fields, Node};
use super::pose::read_pose;
use crate::Error;
use crate::chain::Convention;
use crate::rig::names::problem_of_joint_name;
use crate::rig::{Joint, Limits, Robot};
use crate::urdf::{Arm, ArmJoint, Urdf};
use handeye_solvers::Pose;

pub(super) fn read_urdf(fields: &Fields, file: &Node) -> Result<Robot, Error> {
    for key in ["convention", "joints", "start", "link"] {
        if let Some(field) = fields.field(key) {
            return Err(field.value.error("the robot is described by `urdf`, and by nothing else beside it"));
        }
    }
    let (name, text) = file.text_of_file()?;
    let urdf = Urdf::parse(&text, &name)?;
    let link = |key: &str, only: Result<&str, String>| match fields.field(key).filter(|field| !field.value.is_table()) {
        Some(field) => urdf.link(field.value.text()?).map(str::to_owned).map_err(|problem| field.value.error(problem)),
        None => only
            .map(str::to_owned)
            .map_err(|problem| fields.error(format!("has no `{key}`, the name of a link, and of {name} {problem}"))),
    };
    let (base, tip) = (link("base", urdf.root())?, link("tip", urdf.leaf())?);
    let arm = urdf.arm(&base, &tip).map_err(|error| match error {
        Error::Unusable(problem) => file.error(problem),
        other => other,
    })?;
    if let Some(problem) = arm.joints.iter().find_map(|joint| problem_of_joint_name(&joint.name)) {
        return Err(file.error(problem));
    }
    Ok(Robot { base: pose(fields)?, ..Robot::from(arm) })
}

/// Where the base stands in the world: `pose`, or `base` where that names no link.
fn pose(fields: &Fields) -> Result<Option<Pose>, Error> {
    match (fields.field("base").filter(|field| field.value.is_table()), fields.field("pose")) {
        (Some(_), Some(pose)) => Err(pose.value.error("`base` is a pose already: one of the two")),
        (Some(pose), None) | (None, Some(pose)) => read_pose(&pose.value).map(Some),
        (None, None) => Ok(None),
    }
}

impl From<Arm> for Robot {
    /// The robot whose base is anywhere in the world.
    fn from(arm: Arm) -> Robot {
        Robot {
            convention: Convention::ModifiedDh,
            base: None,
            link: Some(arm.base),
            start: Some(arm.start),
            joints: arm.joints.into_iter().map(Joint::from).collect(),
        }
    }
}

impl From<ArmJoint> for Joint {
    fn from(joint: ArmJoint) -> Joint {
        let [offset, d, a, alpha, beta] = joint.row;
        let limits = Limits {
            lower: joint.range.map(|[lower, _]| lower),
            upper: joint.range.map(|[_, upper]| upper),
            velocity: joint.velocity,
            acceleration: None,
        };
        Joint {
            name: joint.name,
            kind: joint.kind,
            offset: Some(offset),
            d: Some(d),
            a: Some(a),
            alpha: Some(alpha),
            beta: joint.has_beta.then_some(beta),
            reversed: false,
            limits,
            link: Some(joint.link),
            frame: Some(joint.frame),
        }
    }
}
