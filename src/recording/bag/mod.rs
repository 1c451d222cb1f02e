//! Bags of ROS 2 in MCAP files, or folders of them, as recordings.
//!
//! A bag is read twice, in the memory that one chunk and the samples take: images first, which are the samples, and then where the
//! robot was at their stamps. Messages are decoded by the schemas that the file carries.
mod cameras;
mod folder;
mod frames;
mod images;
mod joints;
mod kinds;
mod labels;
mod messages;
mod schema;
mod states;
mod topics;
mod value;

use super::groups::{Group, groups, moments, samples, split};
use super::order::note_on_others;
use super::same_joints::are_those;
use super::track::At;
use super::whereabouts::{Whereabouts, note_on_apart};
use super::{OpenOptions, Opened, Recording};
use crate::Error;
pub(super) use folder::is_bag;
use images::Images;
use kinds::Kind;
use states::States;
use std::path::Path;
use topics::choose;

/// What of a bag is meant, where its types alone do not tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagOptions {
    /// The topic of joint states; not needed where there is only one.
    pub joint_topic: Option<String>,
    /// The topic of tip poses (PoseStamped). Where none is named and there are no joint states, the only one is taken.
    pub pose_topic: Option<String>,
    /// The frames of the base and the tip, for tip poses from TF.
    pub frames: Option<[String; 2]>,
    /// Topics of detections, with the name of the camera where it is not that of the frame; empty: all.
    pub camera_topics: Vec<(String, Option<String>)>,
    /// Images of several cameras at most this far apart make one sample [s]; `None`: half the time between two images, unless the robot moved
    /// between them.
    pub join: Option<f64>,
}

/// What was found in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Its width and height [px].
    pub size: [u32; 2],
    /// Names and pixels of features.
    pub features: Vec<(String, [f64; 2])>,
}

/// Looks for features in PNG or JPEG images; of each what it shows, or why it cannot be looked at, in words.
pub type Detect<'a> = dyn FnMut(&[&[u8]]) -> Vec<Result<Found, String>> + 'a;

impl Recording {
    /// Reads a bag as [`Recording::open_with`] does, with the features that are found in its compressed images (sensor_msgs/CompressedImage), in
    /// place of those that it holds. Images that cannot be looked at are left out, which is said.
    ///
    /// Errors: those of [`Recording::open_with`], and [`Error::Unusable`] for images whose size is not that of those before or of their CameraInfo.
    pub fn detect_with<'a>(
        path: &'a Path,
        options: &'a OpenOptions,
        detect: &'a mut Detect<'a>,
    ) -> Result<Opened, Error> {
        read(path, options, Some(detect))?.with_cameras(&path.display().to_string(), options)
    }
}

/// Reads an MCAP file, or those of a folder as one; what `detect` finds in its images is taken in place of the features that it holds.
///
/// Features: the corners of AprilTags `FAMILY:ID/CORNER`, the centres of Detection2D by their id. Samples are the times at which images show
/// features, in their order, with joint states interpolated to their stamps, tip poses too (slerp). A file that is cut off or damaged is read as
/// far as it goes.
///
/// Errors: [`Error::Io`], and [`Error::Unusable`] with file and topic for messages that do not fit their schema, topics that are
/// missing or more than one, and a file without images.
pub(super) fn read<'a>(
    path: &'a Path,
    options: &'a OpenOptions,
    detect: Option<&'a mut Detect<'a>>,
) -> Result<Opened, Error> {
    let of_bag = &options.bag;
    let wanted = match detect {
        Some(_) => "compressed image (sensor_msgs/CompressedImage) that shows what is looked for",
        None => "image with features (apriltag_msgs/AprilTagDetectionArray or vision_msgs/Detection2DArray)",
    };
    let is_of_messages = detect.is_none();
    let mut images = Images::new(path, of_bag, detect);
    let files = folder::files(path)?;
    let problems = messages::visit(&files, &mut images)?;
    let mut notes: Vec<String> = problems.into_iter().chain(images.finish()?).collect();
    let mut of_cameras = Vec::new();
    let (cameras, camera_of_source) = cameras::cameras(path, &mut images, options, &mut of_cameras)?;
    let within = of_bag.join.map(|seconds| (seconds * 1e9) as i64);
    let groups = groups(&images.images, &camera_of_source, within);
    if groups.is_empty() {
        let cut_off = notes.first().map_or_else(String::new, |note| format!(", and it {note}"));
        let on_topics = if of_bag.camera_topics.is_empty() { "" } else { " on the topics of --camera-topic" };
        let has_images = images.topics.iter().any(|topic| topic.kind == Some(Kind::CompressedImage));
        let would_do = if is_of_messages && has_images { "; `handeye detect` looks at compressed images" } else { "" };
        let there = topics::list(&images.topics);
        return Err(Error::Unusable(format!(
            "{}: has no {wanted}{on_topics}; it has {there}{cut_off}{would_do}",
            path.display(),
        )));
    }
    let topics = &images.topics;
    let unusable = |problem: String| Error::Unusable(format!("{}: {problem}", path.display()));
    let joint_topic = match (&of_bag.joint_topic, images.joints.topic(options)) {
        (None, Some(topic)) => Some(topic),
        (named, _) => choose(topics, Kind::JointStates, named.as_deref(), "--joint-topic", path)?,
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
        named => choose(topics, Kind::Pose, named.as_deref(), "--pose-topic", path)?,
    };
    let moments = moments(&groups, &images.images);
    let mut states = States::new(path, options, &moments, [joint_topic, pose_topic], &joint_names);
    if joint_topic.is_some() || pose_topic.is_some() || of_bag.frames.is_some() {
        messages::visit(&files, &mut states)?;
    }
    let poses = match &of_bag.frames {
        Some([base, tip]) => {
            states.frames.poses(&moments, base.trim_start_matches('/'), tip.trim_start_matches('/')).map_err(
                |problem| unusable(format!("{problem}; --base-frame and --tip-frame name two that hang together")),
            )?
        }
        None => states.poses.at(&moments),
    };
    let joints = states.joints.at(&moments);
    let whereabouts = Whereabouts { moments: moments.clone(), joints, poses };
    let (groups, apart) = match of_bag.join {
        Some(_) => (groups, 0),
        None => split(groups, &images.images, |first, last| whereabouts.moved(first, last)),
    };
    let Whereabouts { joints, poses, .. } = whereabouts.of(&groups);
    notes.append(&mut of_cameras);
    notes.extend(note_on_groups(&groups, apart));
    if joint_topic.is_some() {
        notes.extend(note_on_states("joint states", &joints, states.joints.span()));
    }
    if pose_topic.is_some() || of_bag.frames.is_some() {
        notes.extend(note_on_states("tip poses", &poses, states.poses.span()));
    }
    for (number, what) in [
        (states.skipped, "joint states lack a joint or a position, and are left out"),
        (images.not_finite, "detections are no numbers, and are left out"),
    ] {
        if number > 0 {
            notes.push(format!("{number} {what}"));
        }
    }
    notes.extend(note_on_others(images.joints.all(), &joint_names));
    if options.joints.is_empty() && !joint_names.is_empty() && !are_those(&options.known_joints, &joint_names) {
        let order = joint_names.join(", ");
        notes.push(format!(
                "joints are in the order of the joint state that has most: {order}; where that is not from base to tip, give a rig with these names or --joints"
            ));
    }
    let states = joints.into_iter().zip(poses);
    let states = states.map(|(joints, pose)| (joints.map(|at| at.value), pose.map(|at| at.value)));
    let (samples, features, twice) = samples(&groups, images.images, images.features.names, &camera_of_source, states);
    if twice > 0 {
        notes.push(format!("{twice} detections are of a feature that the same image has already, and are left out"));
    }
    let mut recording = Recording { joints: joint_names, cameras, features, samples };
    let file = path.display().to_string();
    let described = recording.describe_those_there(&options.cameras);
    described.map_err(|problem| Error::Unusable(format!("{file}: {problem}")))?;
    Ok(Opened { recording: recording.checked_as(&file)?, notes, images: Vec::new() })
}

fn note_on_groups(groups: &[Group], apart: usize) -> Vec<String> {
    let spread = groups.iter().map(|group| group.spread).max().filter(|spread| *spread > 0);
    let spread =
        spread.map(|spread| format!("images that make one sample are up to {:.6} s apart", spread as f64 / 1e9));
    let apart = note_on_apart(apart).map(|note| format!("{note} (--join S makes one of all within S seconds)"));
    spread.into_iter().chain(apart).collect()
}

fn note_on_states<T>(what: &str, found: &[Option<At<T>>], span: Option<[i64; 2]>) -> Vec<String> {
    let mut notes = Vec::new();
    let largest = found.iter().flatten().map(|at| at.gap).max().unwrap_or(0);
    if largest > 0 {
        notes.push(format!("{what} are interpolated, between two that are up to {:.6} s apart", largest as f64 / 1e9));
    }
    let missing = found.iter().filter(|at| at.is_none()).count();
    if missing > 0 {
        let within = span.map_or_else(String::new, |[first, last]| {
            format!(", which go from {:.6} s to {:.6} s", first as f64 / 1e9, last as f64 / 1e9)
        });
        notes.push(format!("{missing} of {} samples are outside the {what}{within}, and have none", found.len()));
    }
    notes
}
