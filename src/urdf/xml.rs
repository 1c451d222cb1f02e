//! XML with its places: elements and attributes, of which what is wrong can be said where it stands.
use crate::Error;
use roxmltree::{Attribute, Document, Node};

/// A text and what the user calls it.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) file: &'a str,
    pub(super) text: &'a str,
}

impl<'a> Source<'a> {
    pub(super) fn parse(self) -> Result<Document<'a>, Error> {
        Document::parse(self.text).map_err(|error| {
            let (line, column) = (error.pos().row as usize, error.pos().col as usize);
            let message = error.to_string();
            // The place stands in front already.
            let problem = message.strip_suffix(&format!(" at {line}:{column}")).unwrap_or(&message);
            Error::Malformed {
                file: self.file.to_owned(),
                line,
                column,
                problem: format!("this is not XML: {problem}"),
            }
        })
    }

    pub(super) fn error(self, offset: usize, problem: impl Into<String>) -> Error {
        Error::at(self.file, self.text, offset, problem.into())
    }

    /// An attribute that has to be there.
    pub(super) fn attribute<'d>(self, node: Node<'d, 'a>, what: &str, name: &str) -> Result<Attribute<'d, 'a>, Error> {
        node.attribute_node(name).ok_or_else(|| self.error(node.range().start, format!("{what} has no `{name}`")))
    }

    /// Numbers of an attribute, separated by white space.
    pub(super) fn numbers<const N: usize>(self, attribute: Attribute, what: &str) -> Result<[f64; N], Error> {
        let fails = |problem: String| self.error(attribute.range_value().start, format!("{what}: {problem}"));
        let words: Vec<&str> = attribute.value().split_whitespace().collect();
        let mut numbers = [0.0; N];
        if words.len() != N {
            let plural = if N == 1 { "" } else { "s" };
            return Err(fails(format!("`{}`: expected {N} number{plural}, found {}", attribute.name(), words.len())));
        }
        for (number, word) in numbers.iter_mut().zip(words) {
            *number =
                word.parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(|| {
                    fails(format!("`{}`: expected a finite number, found `{word}`", attribute.name()))
                })?;
        }
        Ok(numbers)
    }
}

/// The first element of that name inside another.
pub(super) fn child<'d, 'a>(node: Node<'d, 'a>, name: &str) -> Option<Node<'d, 'a>> {
    node.children().find(|child| child.is_element() && child.tag_name().name() == name)
}
