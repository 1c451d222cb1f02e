//! Which joints the states of a bag name: those of an arm and of its gripper may come on one topic or on two.
use super::value::{Texts, Value};
use crate::recording::OpenOptions;
use crate::recording::names::joint_name;

/// The lists of names in joint states, each once, in the order in which they were first met.
#[derive(Default)]
pub(super) struct JointLists(Vec<List>);

struct List {
    topic: String,
    /// The names as they stand in the message.
    bytes: Vec<u8>,
    names: Vec<String>,
}

impl JointLists {
    /// True where the names of a state are known, of which nothing else needs to be read.
    pub(super) fn has(&self, topic: &str, state: &Value) -> bool {
        let is_same = |names: Texts| self.0.iter().any(|list| list.topic == topic && list.bytes == names.bytes);
        state.texts("name").is_some_and(is_same)
    }

    /// Takes the names of a state that are not known; one without positions says nothing of joints.
    pub(super) fn add(&mut self, topic: &str, state: &Value) {
        let (Some(names), Some(positions)) = (state.texts("name"), state.numbers("position")) else { return };
        if positions.is_empty() {
            return;
        }
        let bytes = names.bytes.to_vec();
        if let Ok(names) = names.to_vec() {
            let names = names.iter().take(positions.len()).map(|name| joint_name(name)).collect();
            self.0.push(List { topic: topic.to_owned(), bytes, names });
        }
    }

    /// The only topic of which a state has all joints that are asked for, or that the rig has.
    pub(super) fn topic(&self, options: &OpenOptions) -> Option<&str> {
        let wanted = wanted(options);
        let mut with_all = self.0.iter().filter(|list| list.has_all(&wanted)).map(|list| list.topic.as_str());
        let first = with_all.next()?;
        with_all.all(|other| other == first).then_some(first)
    }

    /// The joints from base to tip: as asked for, as in the rig where a state has all of those, or else as in the state that has most, of several
    /// the first. Empty where no state has any.
    ///
    /// Errors: in words, for joints that are asked for and in no state.
    pub(super) fn order(&self, topic: &str, options: &OpenOptions) -> Result<Vec<String>, String> {
        let lists = || self.0.iter().filter(|list| list.topic == topic);
        let Some(longest) = lists().rev().max_by_key(|list| list.names.len()) else { return Ok(Vec::new()) };
        let wanted = wanted(options);
        if lists().any(|list| list.has_all(&wanted)) {
            return Ok(wanted);
        }
        if options.joints.is_empty() {
            return Ok(longest.names.clone());
        }
        let missing = wanted.iter().find(|joint| lists().all(|list| !list.names.contains(joint)));
        let there = lists().map(|list| list.names.join(", ")).collect::<Vec<_>>().join("; ");
        Err(match missing {
            Some(missing) => format!("has no joint `{missing}`; it has {there}"),
            None => format!("no state has all of the joints {}; their joints are {there}", wanted.join(", ")),
        })
    }

    /// All joints of all topics.
    pub(super) fn all(&self) -> impl Iterator<Item = &String> {
        self.0.iter().flat_map(|list| &list.names)
    }
}

impl List {
    fn has_all(&self, wanted: &[String]) -> bool {
        !wanted.is_empty() && wanted.iter().all(|joint| self.names.contains(joint))
    }
}

fn wanted(options: &OpenOptions) -> Vec<String> {
    let names = if options.joints.is_empty() { &options.known_joints } else { &options.joints };
    names.iter().map(|name| joint_name(name)).collect()
}
