//! Reading where a scene leads: its target, and its task.
use super::read::{joints, per_joint};
use super::{Target, Waypoint};
use crate::Error;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::rig::read::document::{Fields, Node};
use crate::servo::image_tasks::{ImageTask, catalog};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// The table `target` of a scene.
pub(super) fn read_target(fields: &Fields, rig: Option<&Rig>, folder: &Path) -> Result<Target, Error> {
    if let (Some(until), None) = (fields.field("until"), fields.field("velocity")) {
        return Err(until.value.error("says for how long `velocity` moves the target, and there is none"));
    }
    Ok(Target {
        joints: joints(fields, "joints", rig)?,
        velocity: fields.optional("velocity", |node| per_joint(node, rig))?.unwrap_or_default(),
        until: fields.optional("until", Node::not_negative)?.unwrap_or(f64::INFINITY),
        path: fields.optional("path", |node| read_path(node, folder))?.unwrap_or_default(),
    })
}

/// A list of [s, m, m, m], or a recording beside the scene whose poses are those of whoever moves the target.
fn read_path(node: &Node, folder: &Path) -> Result<Vec<Waypoint>, Error> {
    let path = if node.is_list() {
        let waypoint = |node: &Node| {
            let [time, x, y, z] = node.numbers::<4>()?;
            let motion = Pose { rotation: Matrix3::identity(), translation: Vector3::new(x, y, z) };
            Ok(Waypoint { time, motion })
        };
        node.list()?.iter().map(waypoint).collect::<Result<Vec<_>, Error>>()?
    } else {
        let recording = Recording::read_all(&[folder.join(node.text()?)]).map_err(|error| match error {
            error @ Error::Io { .. } => node.error(error),
            error => error,
        })?;
        let poses = recording.samples.iter().filter_map(|sample| Some((sample.time?, sample.pose?)));
        let poses: Vec<(f64, Pose)> = poses.collect();
        let Some((began, first)) = poses.first() else {
            return Err(node.error("has no sample with `time` and `pose`, which say how the target moves"));
        };
        poses.iter().map(|(time, pose)| Waypoint { time: time - began, motion: *pose * first.inverse() }).collect()
    };
    if path.is_empty() {
        return Err(node.error("has no place: expected at least one [s, m, m, m]"));
    }
    if path.windows(2).any(|pair| pair[1].time <= pair[0].time)
        || path.iter().any(|waypoint| !waypoint.time.is_finite())
    {
        return Err(node.error("has times that do not ascend"));
    }
    Ok(path)
}

/// A shipped task, a task file beside the scene, or a table.
pub(super) fn read_task(node: &Node, folder: &Path) -> Result<ImageTask, Error> {
    if node.is_table() {
        return ImageTask::of_node(node.clone());
    }
    let name = node.text()?;
    if let Some((_, text)) = catalog::ALL.iter().find(|(known, _)| *known == name) {
        return ImageTask::parse(text, &format!("models/tasks/{name}.toml"));
    }
    ImageTask::read(&folder.join(name)).map_err(|error| match error {
        Error::Io { source, .. } => {
            let known: Vec<&str> = catalog::ALL.iter().map(|(known, _)| *known).collect();
            let known = known.join(", ");
            node.error(format!("`{name}` is no task file beside the scene ({source}), nor a shipped task ({known})"))
        }
        error => error,
    })
}
