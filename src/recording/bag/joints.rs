//! Which joints the states of a bag name: those of an arm and of its gripper may come on one topic or on two.
use super::value::{Texts, Value};
use crate::recording::OpenOptions;
use crate::recording::names::joint_name;
use crate::recording::same_joints::{Places, places, several};
use std::collections::BTreeSet;

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
            if positions.len() < names.len() {
                return;
            }
            let names = names.iter().map(|name| joint_name(name)).collect();
            self.0.push(List { topic: topic.to_owned(), bytes, names });
        }
    }

    /// The only topic on which all joints are that are asked for, or that the rig has: as they are, or else within a prefix and suffix.
    pub(super) fn topic(&self, options: &OpenOptions) -> Option<&str> {
        let topics: BTreeSet<&str> = self.0.iter().map(|list| list.topic.as_str()).collect();
        let is_asked = !options.joints.is_empty();
        let wanted = if is_asked { asked_for(options) } else { options.known_joints.clone() };
        if wanted.is_empty() {
            return None;
        }
        let has_just_so = |topic: &str| {
            let names = self.names(topic);
            wanted.iter().all(|joint| names.contains(joint))
        };
        let has_within = |topic: &str| !is_asked && matches!(places(&wanted, &self.names(topic)), Places::Found(_));
        let which =
            |is_it: &dyn Fn(&str) -> bool| topics.iter().copied().filter(|topic| is_it(topic)).collect::<Vec<&str>>();
        let just_so = which(&has_just_so);
        let found = if just_so.is_empty() { which(&has_within) } else { just_so };
        if let [topic] = found[..] { Some(topic) } else { None }
    }

    /// The joints from base to tip: as asked for, as in the rig where a state has all of those, or else as in the state that has most, of several
    /// the first. Empty where no state has any.
    ///
    /// Errors: in words, for joints that are asked for and in no state, and where those of the rig may be others too.
    pub(super) fn order(&self, topic: &str, options: &OpenOptions) -> Result<Vec<String>, String> {
        let lists = || self.0.iter().filter(|list| list.topic == topic);
        let Some(longest) = lists().rev().max_by_key(|list| list.names.len()) else { return Ok(Vec::new()) };
        let has_all = |wanted: &[String]| lists().any(|list| wanted.iter().all(|joint| list.names.contains(joint)));
        if options.joints.is_empty() {
            let names = self.names(topic);
            return match places(&options.known_joints, &names) {
                Places::Several(first) => Err(several(&first)),
                Places::Found(places) => {
                    let found: Vec<String> = places.into_iter().map(|place| names[place].clone()).collect();
                    Ok(if has_all(&found) { found } else { longest.names.clone() })
                }
                Places::Missing => Ok(longest.names.clone()),
            };
        }
        let wanted = asked_for(options);
        if has_all(&wanted) {
            return Ok(wanted);
        }
        let missing = wanted.iter().find(|joint| lists().all(|list| !list.names.contains(joint)));
        let there = lists().map(|list| list.names.join(", ")).collect::<Vec<_>>().join("; ");
        Err(match missing {
            Some(missing) => format!("has no joint `{missing}`; it has {there}"),
            None => format!("no state has all of the joints {}; their joints are {there}", wanted.join(", ")),
        })
    }

    /// All joints of a topic, each once, in the order in which they were first met.
    fn names(&self, topic: &str) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self.0.iter().filter(|list| list.topic == topic).flat_map(|list| &list.names) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    /// All joints of all topics.
    pub(super) fn all(&self) -> impl Iterator<Item = &String> {
        self.0.iter().flat_map(|list| &list.names)
    }
}

fn asked_for(options: &OpenOptions) -> Vec<String> {
    options.joints.iter().map(|name| joint_name(name)).collect()
}
