//! A pose in a rig file: `{ xyz, quat }` or `{ xyz, rpy }`.
use super::document::Node;
use crate::Error;
use crate::geometry::orientation;
use handeye_solvers::Pose;
use nalgebra::Vector3;

pub(super) fn read_pose(node: &Node) -> Result<Pose, Error> {
    let fields = node.clone().table(&["xyz", "quat", "rpy"])?;
    let xyz = fields
        .optional("xyz", Node::numbers::<3>)?
        .ok_or_else(|| fields.error("has no `xyz`: a pose is { xyz = [x, y, z], quat = [x, y, z, w] }"))?;
    let rotation = match (fields.field("quat"), fields.field("rpy")) {
        (Some(quat), None) => orientation::from_quaternion(quat.value.numbers()?)
            .ok_or_else(|| quat.value.error("a quaternion of length 0 is no rotation (none is [0, 0, 0, 1])"))?,
        (None, Some(rpy)) => orientation::from_rpy(rpy.value.numbers()?),
        (Some(_), Some(rpy)) => return Err(rpy.value.error("the rotation is given twice: `quat` or `rpy`, not both")),
        (None, None) => {
            return Err(fields.error("has no rotation: give `quat` = [x, y, z, w] or `rpy` = [roll, pitch, yaw]"));
        }
    };
    Ok(Pose { rotation, translation: Vector3::from(xyz) })
}
