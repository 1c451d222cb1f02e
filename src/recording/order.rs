//! Joints by their names.
use super::names::joint_name;
use super::same_joints::{Places, places, several};
use super::{OpenOptions, Recording};
use crate::error::suggestion;

impl Recording {
    /// Takes the joints that the options name, or else those that they know where the recording has all of them, in that order; what has to be said
    /// of it.
    ///
    /// Errors: in words, for joints that are named and not there, or twice, and where several may be those that are known.
    pub(super) fn take_joints(&mut self, options: &OpenOptions) -> Result<Vec<String>, String> {
        let is_named = !options.joints.is_empty();
        let places = match places(&options.known_joints, &self.joints) {
            _ if is_named => self.places_of(&options.joints)?,
            Places::Found(places) => places,
            Places::Several(first) => return Err(several(&first)),
            Places::Missing => return Ok(Vec::new()),
        };
        if places.iter().copied().eq(0..self.joints.len()) {
            return Ok(Vec::new());
        }
        let names: Vec<String> = places.iter().map(|place| self.joints[*place].clone()).collect();
        let taken = |row: &Vec<f64>| places.iter().map(|place| row[*place]).collect::<Vec<f64>>();
        for sample in &mut self.samples {
            sample.joints = sample.joints.as_ref().map(taken);
            sample.joint_action = sample.joint_action.as_ref().map(taken);
        }
        let before = std::mem::replace(&mut self.joints, names.clone());
        let order = (!is_named && !places.is_sorted()).then(|| {
            let (ours, theirs) = (names.join(", "), before.join(", "));
            format!("joints are taken by their names, in the order {ours}; the file has them in the order {theirs}")
        });
        Ok(order.into_iter().chain(note_on_others(&before, &names)).collect())
    }

    /// Where joints stand that are named. Errors: in words, for one that is not there, or named twice.
    fn places_of(&self, named: &[String]) -> Result<Vec<usize>, String> {
        let mut places = Vec::new();
        for name in named {
            let is_it = |joint: &String| *joint == joint_name(name);
            let Some(place) = self.joints.iter().position(is_it) else {
                let there = suggestion(name, self.joints.iter().map(String::as_str));
                return Err(format!("there is no joint `{name}` {there}"));
            };
            if places.contains(&place) {
                return Err(format!("--joints names `{name}` twice"));
            }
            places.push(place);
        }
        Ok(places)
    }
}

/// What is said of joints that a file has beside those that are taken.
pub(super) fn note_on_others<'a>(all: impl IntoIterator<Item = &'a String>, taken: &[String]) -> Option<String> {
    let mut others: Vec<&str> = Vec::new();
    for name in all {
        if !taken.contains(name) && !others.contains(&name.as_str()) {
            others.push(name);
        }
    }
    let (taken, others_listed) = (taken.join(", "), others.join(", "));
    (!others.is_empty()).then(|| format!("joints that are left out: {others_listed}; those that are taken: {taken}"))
}

/// True where a recording's joints are those of a rig, and not in the same order.
pub(crate) fn is_in_another_order(joints: &[String], of_rig: &[String]) -> bool {
    matches!(places(of_rig, joints), Places::Found(places) if places.len() == joints.len() && !places.is_sorted())
}
