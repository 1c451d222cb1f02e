//! The table `[noise]`: standard deviations.
use super::document::Node;
use crate::Error;
use crate::rig::{Noise, PoseNoise};

const KEYS: [&str; 7] = ["pixels", "points", "joints", "pose", "target", "joint_action", "pose_action"];

pub(super) fn read_noise(node: &Node) -> Result<Noise, Error> {
    let fields = node.clone().table(&KEYS)?.labelled("noise");
    let default = Noise::default();
    Ok(Noise {
        pixels: fields.optional("pixels", Node::not_negative)?.unwrap_or(default.pixels),
        points: fields.optional("points", Node::not_negative)?.unwrap_or(default.points),
        joints: fields.optional("joints", Node::not_negative)?.unwrap_or(default.joints),
        pose: fields.optional("pose", read_pose_noise)?.unwrap_or(default.pose),
        target: fields.optional("target", read_target_noise)?,
        joint_action: fields.optional("joint_action", Node::not_negative)?.unwrap_or(default.joint_action),
        pose_action: fields.optional("pose_action", read_pose_noise)?.unwrap_or(default.pose_action),
    })
}

/// Poses of targets have an error: without one, there would be nothing to weigh them by.
fn read_target_noise(node: &Node) -> Result<PoseNoise, Error> {
    let fields = node.clone().table(&["xyz", "rot"])?;
    let sd = |key: &str| {
        fields
            .optional(key, Node::positive)?
            .ok_or_else(|| fields.error(format!("has no `{key}` (m for xyz, rad for rot)")))
    };
    Ok(PoseNoise { xyz: sd("xyz")?, rot: sd("rot")? })
}

pub(crate) fn read_pose_noise(node: &Node) -> Result<PoseNoise, Error> {
    let fields = node.clone().table(&["xyz", "rot"])?;
    let default = PoseNoise::default();
    Ok(PoseNoise {
        xyz: fields.optional("xyz", Node::not_negative)?.unwrap_or(default.xyz),
        rot: fields.optional("rot", Node::not_negative)?.unwrap_or(default.rot),
    })
}
