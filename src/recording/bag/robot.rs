//! Which messages of a bag say where the robot was, and where it was at the moments of the samples.
use super::images::Images;
use super::kinds::Kind;
use super::messages::visit;
use super::states::States;
use super::topics::choose;
use crate::Error;
use crate::recording::OpenOptions;
use crate::recording::clock::seconds;
use crate::recording::order::note_on_others;
use crate::recording::same_joints::are_those;
use crate::recording::track::At;
use crate::recording::whereabouts::Whereabouts;
use std::path::{Path, PathBuf};

/// The topics and frames that are meant.
pub(super) struct Robot<'a> {
    path: &'a Path,
    options: &'a OpenOptions,
    joint_topic: Option<String>,
    /// From base to tip.
    pub joint_names: Vec<String>,
    pose_topic: Option<String>,
}

/// What is said of messages beside what they say of the robot: from when to when they go [ns], and how many joint states lack something.
pub(super) struct Messages {
    joints: Option<[i64; 2]>,
    poses: Option<[i64; 2]>,
    seen: usize,
    skipped: usize,
}

impl<'a> Robot<'a> {
    /// Errors: [`Error::Unusable`] where topics or joints are named that are not there, or may be several.
    pub(super) fn new(path: &'a Path, options: &'a OpenOptions, images: &Images) -> Result<Robot<'a>, Error> {
        let of_bag = &options.bag;
        let unusable = |problem: String| Error::Unusable(format!("{}: {problem}", path.display()));
        let joint_topic = match (&of_bag.joint_topic, images.joints.topic(options)) {
            (None, Some(topic)) => Some(topic),
            (named, _) => choose(&images.topics, Kind::JointStates, named.as_deref(), "--joint-topic", path)?,
        };
        let joint_names = match joint_topic {
            Some(topic) => {
                images.joints.order(topic, options).map_err(|problem| unusable(format!("{topic}: {problem}")))?
            }
            None if !options.joints.is_empty() => {
                return Err(unusable("has no joint states, of which --joints could name some".to_owned()));
            }
            None => Vec::new(),
        };
        let pose_topic = match &of_bag.pose_topic {
            None if joint_topic.is_some() || of_bag.frames.is_some() => None,
            named => choose(&images.topics, Kind::Pose, named.as_deref(), "--pose-topic", path)?,
        };
        let [joint_topic, pose_topic] = [joint_topic, pose_topic].map(|topic| topic.map(str::to_owned));
        Ok(Robot { path, options, joint_topic, joint_names, pose_topic })
    }

    /// Reads where it was at these moments [ns, sorted].
    ///
    /// Errors: [`Error::Io`], and [`Error::Unusable`] for messages that do not fit their schema and frames that do not hang together.
    pub(super) fn read(&self, files: &[PathBuf], moments: Vec<i64>) -> Result<(Whereabouts, Messages), Error> {
        let from = [&self.joint_topic, &self.pose_topic].map(Option::as_deref);
        let frames = &self.options.bag.frames;
        let mut states = States::new(self.path, self.options, &moments, from, &self.joint_names);
        if from != [None; 2] || frames.is_some() {
            visit(files, &mut states)?;
        }
        let poses = match frames {
            Some([base, tip]) => {
                let [base, tip] = [base, tip].map(|frame| frame.trim_start_matches('/'));
                states.frames.poses(&moments, base, tip).map_err(|problem| {
                    let file = self.path.display();
                    Error::Unusable(format!(
                        "{file}: {problem}; --base-frame and --tip-frame name two that hang together"
                    ))
                })?
            }
            None => states.poses.at(&moments),
        };
        let joints = states.joints.at(&moments);
        let [of_joints, of_poses] = [states.joints.span(), states.poses.span()];
        let messages = Messages { joints: of_joints, poses: of_poses, seen: states.seen, skipped: states.skipped };
        Ok((Whereabouts { moments, joints, poses }, messages))
    }

    /// What has to be said of joints and tip poses, and of how they were found; `whereabouts`: those of the samples.
    pub(super) fn notes(&self, whereabouts: &Whereabouts, messages: &Messages, images: &Images) -> Vec<String> {
        let mut notes = Vec::new();
        if self.joint_topic.is_some() {
            notes.extend(note_on_states("joint states", &whereabouts.joints, messages.joints));
        }
        if self.pose_topic.is_some() || self.options.bag.frames.is_some() {
            notes.extend(note_on_states("tip poses", &whereabouts.poses, messages.poses));
        }
        if messages.skipped > 0 {
            let Messages { seen, skipped, .. } = messages;
            notes.push(format!("{skipped} of {seen} joint states lack a joint or a position, and are left out"));
        }
        notes.extend(note_on_others(images.joints.all(), &self.joint_names));
        let OpenOptions { joints, known_joints, .. } = self.options;
        if joints.is_empty() && !self.joint_names.is_empty() && !are_those(known_joints, &self.joint_names) {
            let order = self.joint_names.join(", ");
            notes.push(format!(
                "joints are in the order of the joint state that has most: {order}; where that is not from base to tip, give a rig with these \
                 names or --joints"
            ));
        }
        notes
    }
}

fn note_on_states<T>(what: &str, found: &[Option<At<T>>], span: Option<[i64; 2]>) -> Vec<String> {
    let mut notes = Vec::new();
    let largest = found.iter().flatten().map(|at| at.gap).max().unwrap_or(0);
    if largest > 0 {
        notes.push(format!("{what} are interpolated, between two that are up to {:.6} s apart", seconds(largest)));
    }
    let missing = found.iter().filter(|at| at.is_none()).count();
    if missing > 0 {
        let within = span.map_or_else(String::new, |[first, last]| {
            format!(", which go from {:.6} s to {:.6} s", seconds(first), seconds(last))
        });
        notes.push(format!("{missing} of {} samples are outside the {what}{within}, and have none", found.len()));
    }
    notes
}
