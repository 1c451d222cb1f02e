//! The table `[robot]`: convention, base and joints.
use super::document::{Fields, Node};
use super::named::read_named;
use super::pose::read_pose;
use crate::Error;
use crate::chain::{Convention, JointKind};
use crate::rig::names::problem_of_joint_name;
use crate::rig::{Joint, Limits, Robot};

const JOINT_KEYS: &[&str] = &["name", "type", "offset", "d", "a", "alpha", "beta", "reversed", "limits"];

pub(super) fn read_robot(node: Node) -> Result<Robot, Error> {
    let fields = node.table(&["convention", "base", "joints", "urdf", "tip"])?.labelled("robot");
    for key in ["urdf", "tip"] {
        if let Some(field) = fields.field(key) {
            return Err(field.value.error(
                "robots from URDF files are not supported yet: write the joints as Denavit-Hartenberg rows, [[robot.joints]]",
            ));
        }
    }
    let convention =
        fields.optional("convention", |node| node.word("convention", Convention::ALL, Convention::name))?;
    let joints = fields.field("joints").map(|field| field.value);
    Ok(Robot {
        convention: convention.unwrap_or_default(),
        base: fields.optional("base", read_pose)?,
        joints: read_named(joints.as_ref(), "joint", JOINT_KEYS, problem_of_joint_name)?
            .into_iter()
            .map(|(name, fields)| read_joint(name, &fields))
            .collect::<Result<_, Error>>()?,
    })
}

fn read_joint(name: String, fields: &Fields) -> Result<Joint, Error> {
    Ok(Joint {
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
    })
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
