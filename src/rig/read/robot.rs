//! The table `[robot]`: convention, base and joints.
use super::document::{Fields, Node};
use super::named::read_named;
use super::pose::read_pose;
use super::urdf::read_urdf;
use crate::Error;
use crate::chain::{Convention, JointKind};
use crate::rig::names::problem_of_joint_name;
use crate::rig::{Joint, Limits, Robot};

const ROBOT_KEYS: &[&str] = &["convention", "base", "start", "link", "joints", "urdf", "tip", "pose"];
const JOINT_KEYS: &[&str] =
    &["name", "type", "offset", "d", "a", "alpha", "beta", "reversed", "limits", "link", "frame"];

/// `taken`: the robot where it was made of a URDF already, which is not read again.
pub(super) fn read_robot(node: Node, taken: Option<&Robot>) -> Result<Robot, Error> {
    let fields = node.table(ROBOT_KEYS)?.labelled("robot");
    if let Some(urdf) = fields.field("urdf") {
        return taken.map_or_else(|| read_urdf(&fields, &urdf.value), |robot| Ok(robot.clone()));
    }
    for key in ["tip", "pose"] {
        if let Some(field) = fields.field(key) {
            return Err(field.value.error("goes with `urdf`: rows end at the tip, and `base` is the robot's pose"));
        }
    }
    let start = fields.optional("start", read_pose)?;
    let convention =
        fields.optional("convention", |node| node.word("convention", Convention::ALL, Convention::name))?;
    let joints = fields.field("joints").map(|field| field.value);
    let joints: Vec<Joint> = read_named(joints.as_ref(), "joint", JOINT_KEYS, problem_of_joint_name)?
        .into_iter()
        .map(|(name, fields)| read_joint(name, &fields))
        .collect::<Result<_, Error>>()?;
    let is_known = |joint: &Joint| [joint.offset, joint.d, joint.a, joint.alpha].iter().all(Option::is_some);
    if let (Some(field), Some(joint)) = (fields.field("start"), joints.iter().find(|joint| !is_known(joint))) {
        let problem = format!("it leads to rows that are known, and that of joint `{}` is not", joint.name);
        return Err(field.value.error(problem));
    }
    Ok(Robot {
        convention: convention.unwrap_or_default(),
        base: fields.optional("base", read_pose)?,
        link: fields.optional("link", |node| node.text().map(str::to_owned))?,
        start,
        joints,
    })
}

fn read_joint(name: String, fields: &Fields) -> Result<Joint, Error> {
    let joint = Joint {
        name,
        kind: fields
            .optional("type", |node| node.word("joint type", JointKind::ALL, JointKind::name))?
            .unwrap_or_default(),
        offset: fields.number("offset")?,
        d: fields.number("d")?,
        a: fields.number("a")?,
        alpha: fields.number("alpha")?,
        beta: fields.number("beta")?,
        reversed: fields.optional("reversed", Node::flag)?.unwrap_or_default(),
        limits: fields.optional("limits", read_limits)?.unwrap_or_default(),
        link: fields.optional("link", |node| node.text().map(str::to_owned))?,
        frame: fields.optional("frame", read_pose)?,
    };
    let unknown = [("offset", joint.offset), ("d", joint.d), ("a", joint.a), ("alpha", joint.alpha)];
    match (fields.field("frame"), unknown.iter().find(|(_, value)| value.is_none())) {
        (Some(frame), Some((name, _))) => {
            Err(frame.value.error(format!("a frame stands against a row that is known, and this one has no `{name}`")))
        }
        _ => Ok(joint),
    }
}

fn read_limits(node: &Node) -> Result<Limits, Error> {
    let fields = node.clone().table(&["lower", "upper", "velocity", "acceleration"])?;
    let limits = Limits {
        lower: fields.number("lower")?,
        upper: fields.number("upper")?,
        velocity: fields.optional("velocity", Node::positive)?,
        acceleration: fields.optional("acceleration", Node::positive)?,
    };
    match (limits.lower, limits.upper) {
        (Some(lower), Some(upper)) if lower > upper => {
            Err(fields.error(format!("`lower` is {lower}, which is above `upper`, {upper}")))
        }
        _ => Ok(limits),
    }
}
