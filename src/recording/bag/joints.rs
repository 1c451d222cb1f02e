//! Which joints the states of a bag name: those of an arm and of its gripper may come on one topic or on two.
use super::value::{Texts, Value};
use crate::recording::OpenOptions;
use crate::recording::names::joint_name;
use crate::recording::same_joints::{Places, places, several};

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
        let has_all = |list: &&List| matches!(list.find(options), Places::Found(_));
        let mut with_all = self.0.iter().filter(has_all).map(|list| list.topic.as_str());
        let first = with_all.next()?;
        with_all.all(|other| other == first).then_some(first)
    }

    /// The joints from base to tip: as asked for, as in the rig where a state has all of those, or else as in the state that has most, of several
    /// the first. Empty where no state has any.
    ///
    /// Errors: in words, for joints that are asked for and in no state, and where those of the rig may be others too.
    pub(super) fn order(&self, topic: &str, options: &OpenOptions) -> Result<Vec<String>, String> {
        let lists = || self.0.iter().filter(|list| list.topic == topic);
        let Some(longest) = lists().rev().max_by_key(|list| list.names.len()) else { return Ok(Vec::new()) };
        let found: Vec<(&List, Places)> = lists().map(|list| (list, list.find(options))).collect();
        for (list, places) in &found {
            if let Places::Found(places) = places {
                return Ok(places.iter().map(|place| list.names[*place].clone()).collect());
            }
        }
        if let Some(first) = found.iter().find_map(|(_, places)| places.several()) {
            return Err(several(first));
        }
        if options.joints.is_empty() {
            return Ok(longest.names.clone());
        }
        let wanted = asked_for(options);
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
    /// Where the joints are that are asked for, which are called just so, or else those of the rig.
    fn find(&self, options: &OpenOptions) -> Places {
        if options.joints.is_empty() {
            return places(&options.known_joints, &self.names);
        }
        let place = |name: &String| self.names.iter().position(|known| known == name);
        asked_for(options).iter().map(place).collect::<Option<_>>().map_or(Places::Missing, Places::Found)
    }
}

fn asked_for(options: &OpenOptions) -> Vec<String> {
    options.joints.iter().map(|name| joint_name(name)).collect()
}
