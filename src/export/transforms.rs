//! Where the base and the cameras stand, as ROS takes it: static_transform_publisher, and the YAML of tf2_msgs/TFMessage.
use super::unit;
use crate::Error;
use crate::geometry::orientation;
use crate::rig::{Parent, Rig};
use handeye_solvers::Pose;
use std::fmt::Write;

/// The pose of a frame in its parent.
struct Transform {
    parent: String,
    child: String,
    pose: Pose,
}

/// One command line of static_transform_publisher (ROS 2) for the base, where its pose is known, and for each camera. A
/// camera's frame is the optical one: z forward, x right, y down.
///
/// Where the lengths are no metres, or the arm that was learned is not the one of its data sheet, comments above say so.
///
/// Errors: [`Error::Unusable`] where a camera has no pose, and where there is neither a camera nor the pose of a base.
pub fn to_static_transforms(rig: &Rig) -> Result<String, Error> {
    let mut text = comment(rig);
    for Transform { parent, child, pose } in transforms(rig)? {
        let [x, y, z] = numbers(pose.translation.into());
        let [qx, qy, qz, qw] = numbers(orientation::to_quaternion(&pose.rotation));
        let (parent, child) = (shell_word(&parent), shell_word(&child));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "ros2 run tf2_ros static_transform_publisher --x {x} --y {y} --z {z} --qx {qx} --qy {qy} --qz {qz} --qw {qw} \
             --frame-id {parent} --child-frame-id {child}"
        );
    }
    Ok(text)
}

/// The same as a tf2_msgs/TFMessage in YAML: `ros2 topic pub --once /tf_static tf2_msgs/msg/TFMessage "$(cat tf.yaml)"`, with the
/// quality of service of /tf_static.
///
/// Errors: as above.
pub fn to_tf(rig: &Rig) -> Result<String, Error> {
    let mut text = format!("{}transforms:\n", comment(rig));
    for Transform { parent, child, pose } in transforms(rig)? {
        let [x, y, z] = numbers(pose.translation.into());
        let [qx, qy, qz, qw] = numbers(orientation::to_quaternion(&pose.rotation));
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "- header:\n    frame_id: {parent:?}\n  child_frame_id: {child:?}\n  transform:\n    \
             translation: {{x: {x}, y: {y}, z: {z}}}\n    rotation: {{x: {qx}, y: {qy}, z: {qz}, w: {qw}}}\n"
        );
    }
    Ok(text)
}

/// What has to be known of the transforms, as comment lines that begin with `#`.
fn comment(rig: &Rig) -> String {
    let is_of_arm = |path: &String| path.starts_with("robot.joints.");
    let is_learned = rig.fit.as_ref().is_some_and(|fit| fit.sd.keys().any(is_of_arm));
    let arm = "# of the arm as it was learned: on one with the geometry of its data sheet they are off (--to urdf writes this one)\n";
    unit::comment(rig) + if is_learned { arm } else { "" }
}

fn transforms(rig: &Rig) -> Result<Vec<Transform>, Error> {
    let joints = &rig.robot.joints;
    let link = |index: usize| joints.get(index).map(|joint| joint.link.as_ref().unwrap_or(&joint.name).clone());
    let name = |parent: Parent| match parent {
        Parent::World => "world".to_owned(),
        Parent::Link(joint) => link(joint).unwrap_or_default(),
        Parent::Tip => joints.last().and_then(|joint| joint.link.clone()).unwrap_or_else(|| "tip".to_owned()),
    };
    let mut all = Vec::new();
    let child = rig.robot.link.clone().unwrap_or_else(|| "base".to_owned());
    // A base that is called the world, as in many URDFs, is no child of it.
    if let Some(pose) = rig.robot.base.filter(|_| !joints.is_empty() && child != "world") {
        all.push(Transform { parent: name(Parent::World), child, pose });
    }
    for camera in &rig.cameras {
        let unknown = || Error::Unusable(format!("camera `{}` has no pose: a learned rig has", camera.name));
        all.push(Transform {
            parent: name(camera.parent),
            child: camera.name.clone(),
            pose: camera.pose.ok_or_else(unknown)?,
        });
    }
    if all.is_empty() {
        let problem =
            "the rig has no cameras, and no pose of its base in the world: there is nothing to say where it is";
        return Err(Error::Unusable(problem.into()));
    }
    Ok(all)
}

/// In their shortest form that reads back the same.
fn numbers<const N: usize>(values: [f64; N]) -> [String; N] {
    values.map(|value| format!("{:?}", value + 0.0))
}

fn shell_word(name: &str) -> String {
    let is_plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || "_-/".contains(c));
    if is_plain { name.to_owned() } else { format!("'{}'", name.replace('\'', r"'\''")) }
}
