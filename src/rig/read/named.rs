//! Lists of named things: joints, cameras, features.
use super::document::{Fields, Node};
use crate::Error;
use std::collections::BTreeMap;

/// The tables of a list, each with its name; names are checked, and may come only once.
pub(crate) fn read_named<'a>(
    list: Option<&Node<'a>>,
    kind: &str,
    known: &[&str],
    problem_of_name: impl Fn(&str) -> Option<String>,
) -> Result<Vec<(String, Fields<'a>)>, Error> {
    let mut lines: BTreeMap<String, usize> = BTreeMap::new();
    let mut named = Vec::new();
    for (index, entry) in list.map_or(Ok(Vec::new()), Node::list)?.into_iter().enumerate() {
        let fields = entry.any_table()?.labelled(format!("{kind} {}", index + 1));
        let name = fields.field("name").ok_or_else(|| fields.error("has no `name`"))?.value;
        let text = name.text()?;
        if let Some(problem) = problem_of_name(text) {
            return Err(name.error(problem));
        }
        if let Some(first) = lines.insert(text.to_owned(), name.line()) {
            return Err(name.error(format!("another {kind} is called `{text}`, in line {first}")));
        }
        let fields = fields.labelled(format!("{kind} `{text}`")).node.table(known)?;
        named.push((text.to_owned(), fields));
    }
    Ok(named)
}
