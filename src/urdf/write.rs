//! New joint origins in a URDF, with every other byte as it was.
use super::document::Urdf;
use super::xml::child;
use crate::Error;
use crate::geometry::orientation;
use handeye_solvers::Pose;

/// Poses that differ by less are the same but for rounding, and stay as they are written [m, and radians].
const SAME: f64 = 1e-12;

/// A text to put in place of a range of bytes.
type Edit = (std::ops::Range<usize>, String);

impl Urdf<'_> {
    /// The text with the arm's joints where `links` has them: poses in the base of each joint's link, the last one's that of the
    /// tip, with all readings at 0.
    ///
    /// Errors: where there is no arm from base to tip, or it has another number of joints.
    pub fn with_links(&self, base: &str, tip: &str, links: &[Pose]) -> Result<String, Error> {
        let path = self.path(base, tip)?;
        if path.moving.len() != links.len() {
            let (file, found) = (self.source.file, path.moving.len());
            let problem =
                format!("{file}: {found} joints move between `{base}` and `{tip}`, the rig has {}", links.len());
            return Err(Error::Unusable(problem));
        }
        let mut edits: Vec<Edit> = Vec::new();
        let mut parent = Pose::identity();
        for (index, (moving, link)) in path.moving.iter().zip(links).enumerate() {
            let link = if index + 1 == links.len() { *link * path.tool.inverse() } else { *link };
            let origin = (parent * moving.before).inverse() * link;
            self.put_origin(moving.joint, &moving.origin, &origin, &mut edits);
            parent = link;
        }
        edits.sort_by_key(|(range, _)| range.start);
        let mut text = self.source.text.to_owned();
        for (range, new) in edits.into_iter().rev() {
            text.replace_range(range, &new);
        }
        Ok(text)
    }

    fn put_origin(&self, joint: usize, before: &Pose, now: &Pose, edits: &mut Vec<Edit>) {
        let moved = (before.translation - now.translation).amax() > SAME;
        let turned = (before.rotation - now.rotation).amax() > SAME;
        let xyz = moved.then(|| numbers(now.translation.as_slice()));
        let rpy = turned.then(|| numbers(&orientation::to_rpy(&now.rotation)));
        let values = [("xyz", xyz), ("rpy", rpy)].into_iter().filter_map(|(name, value)| Some((name, value?)));
        let Some(node) = self.document.get_node(self.joints[joint].node) else { return };
        let Some(origin) = child(node, "origin") else {
            let attributes: String = values.map(|(name, value)| format!(" {name}=\"{value}\"")).collect();
            if !attributes.is_empty() {
                // In front of the first element, indented as that is.
                let place = node.first_element_child().map_or(node.range().end, |first| first.range().start);
                let indent = &self.source.text[node.range().start..place];
                let indent = indent.rfind('\n').map(|newline| &indent[newline..]);
                let indent = indent.filter(|indent| indent.trim().is_empty()).unwrap_or("");
                edits.push((place..place, format!("<origin{attributes}/>{indent}")));
            }
            return;
        };
        for (name, value) in values {
            match origin.attribute_node(name) {
                Some(attribute) => edits.push((attribute.range_value(), value)),
                None => {
                    let place = origin.range().start + "<origin".len();
                    edits.push((place..place, format!(" {name}=\"{value}\"")));
                }
            }
        }
    }
}

/// Numbers in their shortest form that reads back the same.
fn numbers(values: &[f64]) -> String {
    // Adding 0 makes -0, which reads like a slip, 0.
    values.iter().map(|value| format!("{:?}", value + 0.0)).collect::<Vec<_>>().join(" ")
}
