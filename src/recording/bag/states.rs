//! The second pass over a bag: where the robot was at the moments of the samples.
use super::frames::Frames;
use super::kinds::{Kind, need, pose, stamp};
use super::messages::{Channel, Visitor};
use super::topics::Topic;
use super::value::Texts;
use crate::Error;
use crate::recording::OpenOptions;
use crate::recording::names::joint_name;
use crate::recording::track::Track;
use handeye_solvers::Pose;
use std::path::Path;

/// What the second pass finds.
pub(super) struct States<'a> {
    path: &'a Path,
    options: &'a OpenOptions,
    /// The moments of the samples [ns], sorted.
    moments: &'a [i64],
    topics: Vec<Topic>,
    /// Topics of joint states and of tip poses.
    joint_topic: Option<&'a str>,
    pose_topic: Option<&'a str>,
    /// Names of the joints, from base to tip.
    joint_names: &'a [String],
    /// The names of the last state as they stand in it, and the place of each joint among them, where it has all.
    last: Option<(Vec<u8>, Option<Vec<usize>>)>,
    /// The joints of the last state, whose memory the next one takes.
    state: Vec<f64>,
    pub joints: Track<Vec<f64>>,
    pub poses: Track<Pose>,
    pub frames: Frames,
    /// Joint states of the topic, and those that lack a joint, or a number.
    pub seen: usize,
    pub skipped: usize,
}

impl<'a> States<'a> {
    pub(super) fn new(
        path: &'a Path,
        options: &'a OpenOptions,
        moments: &'a [i64],
        from: [Option<&'a str>; 2],
        joint_names: &'a [String],
    ) -> Self {
        States {
            path,
            options,
            moments,
            topics: Vec::new(),
            joint_topic: from[0],
            pose_topic: from[1],
            joint_names,
            last: None,
            state: Vec::new(),
            joints: Track::new(moments.len()),
            poses: Track::new(moments.len()),
            frames: Frames::default(),
            seen: 0,
            skipped: 0,
        }
    }

    /// Reads the joints of a state, and says whether it has all of them.
    fn read(&mut self, names: Texts, positions: &[f64]) -> Result<bool, String> {
        if self.last.as_ref().is_none_or(|(last, _)| last != names.bytes) {
            let found: Vec<String> = names.to_vec()?.iter().map(|name| joint_name(name)).collect();
            let places = self.joint_names.iter().map(|joint| found.iter().position(|name| name == joint)).collect();
            self.last = Some((names.bytes.to_vec(), places));
        }
        let places = self.last.as_ref().and_then(|(_, places)| places.as_ref());
        let Some(places) = places.filter(|places| !places.is_empty()) else { return Ok(false) };
        self.state.clear();
        self.state.extend(places.iter().filter_map(|place| positions.get(*place)).filter(|joint| joint.is_finite()));
        Ok(self.state.len() == places.len())
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
                let names = need(message.texts("name"), "name")?;
                let positions = need(message.numbers("position"), "position")?;
                self.seen += 1;
                if self.read(names, positions)? {
                    self.joints.add(moments, stamp(message)?, &self.state);
                } else {
                    self.skipped += 1;
                }
                Ok(())
            }),
            Kind::Pose if is_from(self.pose_topic) => topic.decode(path, time, data, |message| {
                self.poses.add(moments, stamp(message)?, &pose(message, "pose.position", "pose.orientation")?);
                Ok(())
            }),
            Kind::Transforms if self.options.bag.frames.is_some() => topic.decode(path, time, data, |message| {
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
