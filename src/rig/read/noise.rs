//! The table `[noise]`: standard deviations.
use super::document::Node;
use crate::Error;
use crate::rig::{Noise, PoseNoise};

pub(super) fn read_noise(node: &Node) -> Result<Noise, Error> {
    let fields = node.clone().table(&["pixels", "joints", "pose", "joint_action", "pose_action"])?.labelled("noise");
    let default = Noise::default();
    Ok(Noise {
        pixels: fields.optional("pixels", Node::not_negative)?.unwrap_or(default.pixels),
        joints: fields.optional("joints", Node::not_negative)?.unwrap_or(default.joints),
        pose: fields.optional("pose", read_pose_noise)?.unwrap_or(default.pose),
        joint_action: fields.optional("joint_action", Node::not_negative)?.unwrap_or(default.joint_action),
        pose_action: fields.optional("pose_action", read_pose_noise)?.unwrap_or(default.pose_action),
    })
}

fn read_pose_noise(node: &Node) -> Result<PoseNoise, Error> {
    let fields = node.clone().table(&["xyz", "rot"])?;
    let default = PoseNoise::default();
    Ok(PoseNoise {
        xyz: fields.optional("xyz", Node::not_negative)?.unwrap_or(default.xyz),
        rot: fields.optional("rot", Node::not_negative)?.unwrap_or(default.rot),
    })
}
