//! What features are called, found again without asking for memory.
use crate::recording::names::{Names, tidy};
use std::collections::BTreeMap;

/// What a message calls a feature.
#[derive(Clone, Copy, Debug)]
pub(super) enum Label<'a> {
    /// A corner of a tag: its family, its number, and which of its corners.
    Corner(&'a str, f64, usize),
    Text(&'a str),
}

/// Features by their index, in the order in which they were first met.
#[derive(Default)]
pub(super) struct Labels {
    pub names: Names,
    /// For each family of tags the indices of each tag's corners.
    families: Vec<(String, BTreeMap<i64, Vec<u32>>)>,
    texts: BTreeMap<String, u32>,
}

impl Labels {
    /// The index of a feature, which is added where it is new.
    pub(super) fn index(&mut self, label: Label) -> u32 {
        match label {
            Label::Corner(family, id, corner) => self.corner(family, id, corner),
            Label::Text(text) => self.texts.get(text).copied().unwrap_or_else(|| {
                let index = self.names.intern(&tidy(text));
                self.texts.insert(text.to_owned(), index);
                index
            }),
        }
    }

    fn corner(&mut self, family: &str, id: f64, corner: usize) -> u32 {
        let place = self.families.iter().position(|(known, _)| known == family).unwrap_or_else(|| {
            self.families.push((family.to_owned(), BTreeMap::new()));
            self.families.len() - 1
        });
        let corners = self.families[place].1.entry(id as i64).or_default();
        while corners.len() <= corner {
            let name = format!("{family}:{id}/{}", corners.len());
            corners.push(self.names.intern(&tidy(&name)));
        }
        corners[corner]
    }
}
