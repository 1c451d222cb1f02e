//! YAML as a tree with places. Of YAML, what calibration files use: no anchors, little depth; of several documents the first.
use crate::Error;
use saphyr_parser::{Event, Parser};
use std::borrow::Cow;

/// Deeper nesting is none of a calibration file.
const DEEPEST: usize = 16;

/// A value and where it begins.
#[derive(Debug)]
pub(super) struct Node {
    /// Characters before it.
    index: usize,
    content: Content,
}

#[derive(Debug)]
enum Content {
    /// Whether it is a number is for the reader to say.
    Scalar(String),
    List(Vec<Node>),
    /// In the file's order.
    Map(Vec<(String, Node)>),
}

/// A YAML document and what the user calls it.
pub(super) struct Document<'a> {
    file: &'a str,
    text: &'a str,
    pub(super) root: Node,
}

impl<'a> Document<'a> {
    pub(super) fn parse(text: &'a str, file: &'a str) -> Result<Self, Error> {
        let mut growing = Growing::default();
        for event in Parser::new_from_str(&without_opencv_directive(text)) {
            let (event, span) = event.map_err(|error| {
                at(file, text, error.marker().index(), format!("this is not YAML: {}", error.info()))
            })?;
            let place = span.start.index();
            let grown = growing.take(event, place).map_err(|problem| at(file, text, place, problem))?;
            if let Some(root) = grown {
                return Ok(Document { file, text, root });
            }
        }
        Err(at(file, text, 0, "the file is empty".to_owned()))
    }

    pub(super) fn error(&self, node: &Node, problem: impl Into<String>) -> Error {
        at(self.file, self.text, node.index, problem.into())
    }

    /// The value of a key that has to be there.
    pub(super) fn need<'n>(&self, node: &'n Node, key: &str) -> Result<&'n Node, Error> {
        node.get(key).ok_or_else(|| self.error(node, format!("has no `{key}`")))
    }

    pub(super) fn number(&self, node: &Node) -> Result<f64, Error> {
        let number = node.text().and_then(|text| text.parse().ok()).filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.error(node, format!("expected a finite number, found {}", node.description())))
    }

    pub(super) fn numbers(&self, node: &Node) -> Result<Vec<f64>, Error> {
        match &node.content {
            Content::List(list) => list.iter().map(|node| self.number(node)).collect(),
            _ => Err(self.error(node, format!("expected a list of numbers, found {}", node.description()))),
        }
    }
}

impl Node {
    /// The value of a key.
    pub(super) fn get(&self, key: &str) -> Option<&Node> {
        self.entries().iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// The first of several keys that is there.
    pub(super) fn any(&self, keys: &[&str]) -> Option<&Node> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// Keys and values; none where it is no mapping.
    pub(super) fn entries(&self) -> &[(String, Node)] {
        match &self.content {
            Content::Map(entries) => entries,
            _ => &[],
        }
    }

    /// Entries of a list; none where it is no list.
    pub(super) fn items(&self) -> &[Node] {
        match &self.content {
            Content::List(items) => items,
            _ => &[],
        }
    }

    pub(super) fn text(&self) -> Option<&str> {
        match &self.content {
            Content::Scalar(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn description(&self) -> String {
        match &self.content {
            Content::Scalar(text) => format!("`{text}`"),
            Content::List(_) => "a list".to_owned(),
            Content::Map(_) => "a mapping".to_owned(),
        }
    }
}

/// A tree in the making: what is open, outermost first.
#[derive(Default)]
struct Growing {
    open: Vec<Open>,
}

struct Open {
    node: Node,
    /// The key of a mapping that waits for its value.
    key: Option<String>,
}

impl Growing {
    /// The root once it is whole.
    fn take(&mut self, event: Event<'_>, index: usize) -> Result<Option<Node>, String> {
        let node = |content| Node { index, content };
        match event {
            Event::Alias(_) => Err("an alias (`*name`) is not read here: write its value".to_owned()),
            Event::Scalar(text, ..) => self.put(node(Content::Scalar(text.into_owned()))),
            Event::SequenceStart(..) => self.open(node(Content::List(Vec::new()))),
            Event::MappingStart(..) => self.open(node(Content::Map(Vec::new()))),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                Some(done) => self.put(done.node),
                None => Ok(None),
            },
            _ => Ok(None),
        }
    }

    fn open(&mut self, node: Node) -> Result<Option<Node>, String> {
        if self.open.len() >= DEEPEST {
            return Err(format!("nested more than {DEEPEST} deep, which no camera calibration is"));
        }
        self.open.push(Open { node, key: None });
        Ok(None)
    }

    fn put(&mut self, node: Node) -> Result<Option<Node>, String> {
        let Some(parent) = self.open.last_mut() else { return Ok(Some(node)) };
        match &mut parent.node.content {
            Content::List(items) => items.push(node),
            Content::Map(entries) => match (parent.key.take(), node.content) {
                (Some(key), content) => entries.push((key, Node { content, ..node })),
                (None, Content::Scalar(key)) if entries.iter().any(|(known, _)| *known == key) => {
                    return Err(format!("`{key}` is given twice"));
                }
                (None, Content::Scalar(key)) => parent.key = Some(key),
                (None, _) => return Err("a key is a word".to_owned()),
            },
            // A scalar is never opened.
            Content::Scalar(_) => {}
        }
        Ok(None)
    }
}

/// A problem after that many characters.
fn at(file: &str, text: &str, characters: usize, problem: String) -> Error {
    let offset = text.char_indices().nth(characters).map_or(text.len(), |(offset, _)| offset);
    Error::at(file, text, offset, problem)
}

/// OpenCV begins its files with `%YAML:1.0`, which YAML does not know: a comment of the same length.
fn without_opencv_directive(text: &str) -> Cow<'_, str> {
    match text.strip_prefix("%YAML:") {
        Some(rest) => Cow::Owned(format!("#YAML:{rest}")),
        None => Cow::Borrowed(text),
    }
}
