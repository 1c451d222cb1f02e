//! The parts of a rig as tables: joints, cameras, features, targets, noise.
use super::values::{Writer, number, numbers, set};
use crate::rig::{Camera, Feature, Joint, Limits, Noise, Parent, PoseNoise, Target};
use toml_edit::{Array, InlineTable, Item, TableLike, Value};

pub(super) fn write_joint(table: &mut dyn TableLike, before: Option<&Joint>, now: &Joint) {
    let blank = Joint::default();
    let mut writer = Writer { table, fresh: before.is_none() };
    let before = before.unwrap_or(&blank);
    writer.put_default("name", &before.name, &now.name, |name| Value::from(name.as_str()));
    writer.put_default("type", before.kind, now.kind, |kind| Value::from(kind.name()));
    writer.put("offset", &before.offset, &now.offset, |v| number(*v));
    writer.put("d", &before.d, &now.d, |v| number(*v));
    writer.put("a", &before.a, &now.a, |v| number(*v));
    writer.put("alpha", &before.alpha, &now.alpha, |v| number(*v));
    writer.put("beta", &before.beta, &now.beta, |v| number(*v));
    let reversed = |joint: &Joint| joint.reversed.then_some(true);
    writer.put("reversed", &reversed(before), &reversed(now), |v| Value::from(*v));
    write_limits(&mut writer, &before.limits, &now.limits);
    writer.put("link", &before.link, &now.link, |link| Value::from(link.as_str()));
    writer.put_pose("frame", &before.frame, &now.frame);
}

fn write_limits(writer: &mut Writer, before: &Limits, now: &Limits) {
    if before == now {
        return;
    }
    if *now == Limits::default() {
        writer.table.remove("limits");
        return;
    }
    if writer.table.get("limits").is_none() {
        writer.table.insert("limits", Item::Value(Value::InlineTable(InlineTable::new())));
    }
    let Some(table) = writer.table.get_mut("limits").and_then(Item::as_table_like_mut) else { return };
    let mut limits = Writer { table, fresh: writer.fresh };
    limits.put("lower", &before.lower, &now.lower, |v| number(*v));
    limits.put("upper", &before.upper, &now.upper, |v| number(*v));
    limits.put("velocity", &before.velocity, &now.velocity, |v| number(*v));
    limits.put("acceleration", &before.acceleration, &now.acceleration, |v| number(*v));
}

/// `joints`: the names that a parent may have, of the rig before and now.
pub(super) fn write_camera(
    table: &mut dyn TableLike,
    before: Option<(&Camera, &[Joint])>,
    (now, joints): (&Camera, &[Joint]),
) {
    let blank = Camera::default();
    let mut writer = Writer { table, fresh: before.is_none() };
    let (before, joints_before) = before.unwrap_or((&blank, &[]));
    writer.put_default("name", &before.name, &now.name, |name| Value::from(name.as_str()));
    // Values, which say what was learned, take its place.
    writer.table.remove("intrinsics");
    writer.put("size", &before.size, &now.size, |[w, h]| {
        Value::Array([i64::from(*w), i64::from(*h)].into_iter().collect::<Array>())
    });
    writer.put("model", &before.model, &now.model, |model| Value::from(model.name()));
    writer.put("fx", &before.fx, &now.fx, |v| number(*v));
    writer.put("fy", &before.fy, &now.fy, |v| number(*v));
    writer.put("cx", &before.cx, &now.cx, |v| number(*v));
    writer.put("cy", &before.cy, &now.cy, |v| number(*v));
    writer.put("distortion", &before.distortion, &now.distortion, |v| numbers(v));
    let depth = |camera: &Camera| camera.depth.then_some(true);
    writer.put("depth", &depth(before), &depth(now), |v| Value::from(*v));
    write_parent(&mut writer, parent(before.parent, joints_before), parent(now.parent, joints));
    writer.put_pose("pose", &before.pose, &now.pose);
}

pub(super) fn write_feature(
    table: &mut dyn TableLike,
    before: Option<(&Feature, &[Joint])>,
    (now, joints): (&Feature, &[Joint]),
) {
    let mut writer = Writer { table, fresh: before.is_none() };
    let name = before.map_or("", |(before, _)| &before.name);
    writer.put_default("name", name, now.name.as_str(), |name| Value::from(*name));
    let parent_before = before.map_or("tip", |(before, joints)| parent(before.parent, joints));
    write_parent(&mut writer, parent_before, parent(now.parent, joints));
    writer.put("xyz", &before.and_then(|(before, _)| before.xyz), &now.xyz, |v| numbers(v));
}

pub(super) fn write_target(
    table: &mut dyn TableLike,
    before: Option<(&Target, &[Joint])>,
    (now, joints): (&Target, &[Joint]),
) {
    let blank = Target::default();
    let mut writer = Writer { table, fresh: before.is_none() };
    let (before, joints_before) = before.unwrap_or((&blank, &[]));
    writer.put_default("name", &before.name, &now.name, |name| Value::from(name.as_str()));
    write_parent(&mut writer, parent(before.parent, joints_before), parent(now.parent, joints));
    writer.put_pose("pose", &before.pose, &now.pose);
}

fn write_parent(writer: &mut Writer, before: &str, now: &str) {
    writer.put_default("parent", before, now, |name| Value::from(*name));
}

/// The name of a parent. A link that does not exist cannot be written; the world stands in for it.
fn parent(parent: Parent, joints: &[Joint]) -> &str {
    match parent {
        Parent::World => "world",
        Parent::Tip => "tip",
        Parent::Link(joint) => joints.get(joint).map_or("world", |joint| &joint.name),
    }
}

pub(super) fn write_noise(table: &mut dyn TableLike, before: Option<&Noise>, now: &Noise) {
    let mut writer = Writer { table, fresh: before.is_none() };
    let before = before.copied().unwrap_or_default();
    writer.put_default("pixels", before.pixels, now.pixels, |v| number(*v));
    writer.put_default("points", before.points, now.points, |v| number(*v));
    writer.put_default("joints", before.joints, now.joints, |v| number(*v));
    write_pose_noise(&mut writer, "pose", before.pose, now.pose);
    match (before.target, now.target) {
        (before, Some(now)) => write_pose_noise(&mut writer, "target", before.unwrap_or_default(), now),
        (Some(_), None) => drop(writer.table.remove("target")),
        (None, None) => {}
    }
    writer.put_default("joint_action", before.joint_action, now.joint_action, |v| number(*v));
    write_pose_noise(&mut writer, "pose_action", before.pose_action, now.pose_action);
}

fn write_pose_noise(writer: &mut Writer, key: &str, before: PoseNoise, now: PoseNoise) {
    if let Some(table) = writer.table.get_mut(key).and_then(Item::as_table_like_mut) {
        for (key, before, now) in [("xyz", before.xyz, now.xyz), ("rot", before.rot, now.rot)] {
            if before != now {
                set(table, key, number(now));
            }
        }
        return;
    }
    writer.put_default(key, before, now, |noise| {
        let mut table = InlineTable::new();
        table.insert("xyz", number(noise.xyz));
        table.insert("rot", number(noise.rot));
        Value::InlineTable(table)
    });
}
