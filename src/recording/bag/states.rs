//! The second pass over a bag: where the robot was at the moments of the samples.
use super::BagOptions;
use super::frames::Frames;
use super::kinds::{Kind, need, pose, stamp};
use super::messages::{Channel, Visitor};
use super::topics::Topic;
use super::value::Value;
use crate::Error;
use crate::recording::track::Track;
use handeye_solvers::Pose;
use std::path::Path;

/// What the second pass finds.
pub(super) struct States<'a> {
    path: &'a Path,
    options: &'a BagOptions,
    /// The moments of the samples [ns], sorted.
    moments: &'a [i64],
    topics: Vec<Topic>,
    /// Topics of joint states and of tip poses.
    joint_topic: Option<&'a str>,
    pose_topic: Option<&'a str>,
    /// Names of the joints, from base to tip; empty before the first state.
    pub names: Vec<String>,
    /// The names of the last state, and the place of each joint among them.
    last: (Vec<String>, Option<Vec<usize>>),
    pub joints: Track<Vec<f64>>,
    pub poses: Track<Pose>,
    pub frames: Frames,
    /// Joint states that lack a joint, or a number.
    pub skipped: usize,
}

impl<'a> States<'a> {
    pub(super) fn new(path: &'a Path, options: &'a BagOptions, moments: &'a [i64], from: [Option<&'a str>; 2]) -> Self {
        States {
            path,
            options,
            moments,
            topics: Vec::new(),
            joint_topic: from[0],
            pose_topic: from[1],
            names: Vec::new(),
            last: (Vec::new(), None),
            joints: Track::new(moments.len()),
            poses: Track::new(moments.len()),
            frames: Frames::default(),
            skipped: 0,
        }
    }

    /// The joints of a state, where it has all of them.
    fn joints(&mut self, names: &[Value], positions: &[f64]) -> Result<Option<Vec<f64>>, String> {
        let is_text = |(value, known): (&Value, &String)| matches!(value, Value::Text(text) if text == known);
        if self.last.0.len() != names.len() || !names.iter().zip(&self.last.0).all(is_text) || names.is_empty() {
            let text = |value: &Value| if let Value::Text(text) = value { (*text).to_owned() } else { String::new() };
            let names: Vec<String> = names.iter().map(text).collect();
            if self.names.is_empty() {
                self.names = self.order(&names, positions.len())?;
            }
            let places = self.names.iter().map(|joint| names.iter().position(|name| name == joint)).collect();
            self.last = (names, places);
        }
        let Some(places) = self.last.1.as_ref().filter(|places| !places.is_empty()) else { return Ok(None) };
        let joints: Option<Vec<f64>> = places.iter().map(|place| positions.get(*place).copied()).collect();
        Ok(joints.filter(|joints| joints.iter().all(|joint| joint.is_finite())))
    }

    /// The joints from base to tip: as given, as in the rig where the first state has all of those, or else as in that state.
    fn order(&self, names: &[String], positions: usize) -> Result<Vec<String>, String> {
        let BagOptions { joints, known_joints, .. } = self.options;
        if let Some(missing) = joints.iter().find(|joint| !names.contains(joint)) {
            let there = names.join(", ");
            return Err(format!("has no joint `{missing}`; it has {there}"));
        }
        let is_known = !known_joints.is_empty() && known_joints.iter().all(|joint| names.contains(joint));
        Ok(match (joints.is_empty(), is_known) {
            (false, _) => joints.clone(),
            (true, true) => known_joints.clone(),
            // A state without positions says nothing of joints.
            (true, false) => names.iter().take(positions).cloned().collect(),
        })
    }
}

impl Visitor for States<'_> {
    fn channel(&mut self, channel: Channel) -> Result<(), Error> {
        self.topics.push(Topic::new(channel));
        Ok(())
    }

    fn message(&mut self, channel: usize, time: u64, data: &[u8]) -> Result<(), Error> {
        self.topics[channel].messages += 1;
        let Some(kind) = self.topics[channel].kind else { return Ok(()) };
        let (path, moments) = (self.path, self.moments);
        // The topic is apart from what is changed by its messages.
        let topics = std::mem::take(&mut self.topics);
        let topic = &topics[channel];
        let is_from = |named: Option<&str>| named == Some(topic.name.as_str());
        let taken = match kind {
            Kind::JointStates if is_from(self.joint_topic) => topic.decode(path, time, data, |message| {
                let names = need(message.list("name"), "name")?;
                let positions = need(message.numbers("position"), "position")?;
                match self.joints(names, positions)? {
                    Some(joints) => self.joints.add(moments, stamp(message)?, joints),
                    None => self.skipped += 1,
                }
                Ok(())
            }),
            Kind::Pose if is_from(self.pose_topic) => topic.decode(path, time, data, |message| {
                self.poses.add(moments, stamp(message)?, pose(message, "pose.position", "pose.orientation")?);
                Ok(())
            }),
            Kind::Transforms if self.options.frames.is_some() => topic.decode(path, time, data, |message| {
                let is_static = topic.name.ends_with("tf_static");
                let transforms = need(message.list("transforms"), "transforms")?;
                transforms.iter().try_for_each(|transform| self.frames.add(moments, transform, is_static))
            }),
            _ => Ok(()),
        };
        self.topics = topics;
        taken
    }
}
