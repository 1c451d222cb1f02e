//! The table `limits` of a scene.
use super::LimitKind;
use crate::Error;
use crate::rig::read::document::{Fields, Node};
use crate::servo::limits::Guide;
use nalgebra::Vector3;

/// Limits with the names that messages call them by: their keys, or their own.
pub(super) fn read_limits(node: Node) -> Result<Vec<(String, LimitKind)>, Error> {
    let known = ["in_image", "pixel_speed", "tip_speed", "tip_box", "half_spaces", "follow_line", "follow_plane"];
    let fields = node.table(&known)?.labelled("limits");
    let mut limits = Vec::new();
    let mut add = |name: &str, kind: Option<LimitKind>| limits.extend(kind.map(|kind| (name.to_owned(), kind)));
    add("in_image", fields.optional("in_image", Node::number)?.map(LimitKind::InImage));
    add("pixel_speed", fields.optional("pixel_speed", Node::positive)?.map(LimitKind::PixelSpeed));
    add("tip_speed", fields.optional("tip_speed", Node::positive)?.map(LimitKind::TipSpeed));
    add("tip_box", fields.optional("tip_box", read_box)?);
    add("follow_line", fields.optional("follow_line", |node| read_guide(node, "direction", Guide::Line))?);
    add("follow_plane", fields.optional("follow_plane", |node| read_guide(node, "normal", Guide::Plane))?);
    for entry in fields.optional("half_spaces", Node::list)?.unwrap_or_default() {
        let plane = entry.table(&["name", "normal", "offset"])?;
        let normal = direction(&plane, "normal")?;
        // The plane stays where it is when its normal is made of unit length.
        let offset = need(&plane, "offset")?.number()? / normal.norm();
        add(need(&plane, "name")?.text()?, Some(LimitKind::HalfSpace(normal.normalize(), offset)));
    }
    Ok(limits)
}

fn read_box(node: &Node) -> Result<LimitKind, Error> {
    let fields = node.clone().table(&["low", "high"])?;
    let [low, high] = [vector(&fields, "low")?, vector(&fields, "high")?];
    if (0..3).any(|k| low[k] > high[k]) {
        return Err(node.error("has a `low` above its `high`"));
    }
    Ok(LimitKind::TipBox(low, high))
}

/// A line by its direction, or a plane by its normal.
fn read_guide(node: &Node, key: &str, guide: fn(Vector3<f64>, Vector3<f64>) -> Guide) -> Result<LimitKind, Error> {
    let fields = node.clone().table(&["point", key, "tolerance"])?;
    let guide = guide(vector(&fields, "point")?, direction(&fields, key)?);
    Ok(LimitKind::Follow(guide, need(&fields, "tolerance")?.positive()?))
}

/// A vector that is not of length 0.
fn direction(fields: &Fields, key: &str) -> Result<Vector3<f64>, Error> {
    let node = need(fields, key)?;
    let vector = Vector3::from(node.numbers::<3>()?);
    if vector.norm() > 0.0 { Ok(vector) } else { Err(node.error("is of length 0")) }
}

fn vector(fields: &Fields, key: &str) -> Result<Vector3<f64>, Error> {
    need(fields, key)?.numbers::<3>().map(Vector3::from)
}

fn need<'a>(fields: &Fields<'a>, key: &str) -> Result<Node<'a>, Error> {
    fields.field(key).map(|field| field.value).ok_or_else(|| fields.error(format!("has no `{key}`")))
}
