//! A URDF as it is read: its links and joints, and how they hang together.
use super::xml::{Source, child};
use crate::Error;
use crate::error::suggestion;
use roxmltree::{Document, NodeId};
use std::collections::BTreeMap;

/// A robot description. Numbers are read where an arm needs them, so that whatever else is in the file may be as it is.
pub struct Urdf<'a> {
    pub(super) source: Source<'a>,
    pub(super) document: Document<'a>,
    /// In the file's order.
    links: Vec<&'a str>,
    pub(super) joints: Vec<Joint<'a>>,
    /// The joint above each link that has one.
    above: BTreeMap<&'a str, usize>,
}

/// A joint, with its element in the document.
pub(super) struct Joint<'a> {
    pub(super) name: &'a str,
    pub(super) kind: &'a str,
    pub(super) parent: &'a str,
    pub(super) child: &'a str,
    pub(super) node: NodeId,
}

impl<'a> Urdf<'a> {
    /// Reads the text of a URDF, which messages call `file`.
    ///
    /// Errors: [`Error::Malformed`] where it is no URDF, or its links are no tree.
    pub fn parse(text: &'a str, file: &'a str) -> Result<Self, Error> {
        let source = Source { file, text };
        let document = source.parse()?;
        let root = document.root_element();
        if root.tag_name().name() != "robot" {
            let found = root.tag_name().name();
            return Err(source.error(root.range().start, format!("expected <robot> of a URDF, found <{found}>")));
        }
        if let Some(node) =
            root.descendants().find(|node| node.tag_name().namespace().is_some_and(|n| n.contains("xacro")))
        {
            let problem = "this is a xacro, which makes a URDF: `xacro FILE > robot.urdf` would do";
            return Err(source.error(node.range().start, problem));
        }
        let mut urdf = Urdf { source, links: Vec::new(), joints: Vec::new(), above: BTreeMap::new(), document };
        urdf.read_links()?;
        urdf.read_joints()?;
        urdf.refuse_rings()?;
        Ok(urdf)
    }

    fn read_links(&mut self) -> Result<(), Error> {
        for node in self.document.root_element().children().filter(|node| node.has_tag_name("link")) {
            let name = raw(&self.source, self.source.attribute(node, "a link", "name")?);
            if self.links.contains(&name) {
                return Err(self.source.error(node.range().start, format!("another link is called `{name}`")));
            }
            self.links.push(name);
        }
        Ok(())
    }

    fn read_joints(&mut self) -> Result<(), Error> {
        let source = self.source;
        for node in self.document.root_element().children().filter(|node| node.has_tag_name("joint")) {
            let start = node.range().start;
            let name = raw(&source, source.attribute(node, "a joint", "name")?);
            let what = format!("joint `{name}`");
            if self.joints.iter().any(|joint| joint.name == name) {
                return Err(source.error(start, format!("another joint is called `{name}`")));
            }
            let end = |tag: &str| {
                let node =
                    child(node, tag).ok_or_else(|| source.error(start, format!("{what} has no <{tag} link=...>")))?;
                let attribute = source.attribute(node, &format!("{what}: <{tag}>"), "link")?;
                let link = raw(&source, attribute);
                if self.links.contains(&link) {
                    return Ok(link);
                }
                let known = suggestion(link, self.links.iter().copied());
                Err(source.error(attribute.range_value().start, format!("{what}: no link is called `{link}` {known}")))
            };
            let (parent, child) = (end("parent")?, end("child")?);
            let kind = raw(&source, source.attribute(node, &what, "type")?);
            if let Some(other) = self.above.insert(child, self.joints.len()) {
                let other = self.joints[other].name;
                let problem = format!("{what}: its link `{child}` hangs on joint `{other}` already");
                return Err(source.error(start, problem));
            }
            self.joints.push(Joint { name, kind, parent, child, node: node.id() });
        }
        Ok(())
    }

    fn refuse_rings(&self) -> Result<(), Error> {
        for joint in &self.joints {
            if self.ascent(joint.parent).iter().any(|&above| self.joints[above].name == joint.name) {
                let place = self.document.get_node(joint.node).map_or(0, |node| node.range().start);
                let problem = format!("joint `{}` hangs on itself: links are a tree", joint.name);
                return Err(self.source.error(place, problem));
            }
        }
        Ok(())
    }

    /// The link that hangs on nothing, where there is one only.
    ///
    /// Errors: which there are, in words.
    pub fn root(&self) -> Result<&'a str, String> {
        let roots: Vec<&str> = self.links.iter().copied().filter(|link| !self.above.contains_key(link)).collect();
        only(&roots, "no link hangs on nothing", "hang on nothing")
    }

    /// The link on which nothing hangs, where there is one only.
    ///
    /// Errors: which there are, in words.
    pub fn leaf(&self) -> Result<&'a str, String> {
        let carries = |link: &str| self.joints.iter().any(|joint| joint.parent == link);
        let leaves: Vec<&str> = self.links.iter().copied().filter(|link| !carries(link)).collect();
        only(&leaves, "every link carries another", "are the ends of the file's chains")
    }

    /// The link of that name.
    ///
    /// Errors: what would do, in words.
    pub fn link(&self, name: &str) -> Result<&'a str, String> {
        self.links.iter().copied().find(|link| *link == name).ok_or_else(|| {
            format!(
                "no link of {} is called `{name}` {}",
                self.source.file,
                suggestion(name, self.links.iter().copied())
            )
        })
    }

    /// Joints above a link, from the link upwards; a ring, which is refused, ends where it closes.
    pub(super) fn ascent(&self, link: &'a str) -> Vec<usize> {
        let mut ascent: Vec<usize> = Vec::new();
        let mut at = link;
        while let Some(&joint) = self.above.get(at)
            && !ascent.contains(&joint)
        {
            ascent.push(joint);
            at = self.joints[joint].parent;
        }
        ascent
    }
}

/// The one name of a list.
fn only<'a>(names: &[&'a str], none: &str, several: &str) -> Result<&'a str, String> {
    match names {
        [one] => Ok(one),
        [] => Err(none.to_owned()),
        _ => Err(format!("{} {several}", names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "))),
    }
}

/// The value of an attribute as it stands in the text. Names with entities in them (`&amp;`) are compared as they are written.
fn raw<'a>(source: &Source<'a>, attribute: roxmltree::Attribute) -> &'a str {
    &source.text[attribute.range_value()]
}
