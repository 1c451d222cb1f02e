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
mod robot;
mod schema;
mod states;
mod topics;
mod value;

use super::clock::{nanoseconds, seconds};
use super::groups::{Group, groups, moments, samples, split};
use super::whereabouts::{Whereabouts, note_on_apart};
use super::{OpenOptions, Opened, Recording};
use crate::Error;
pub(super) use folder::is_bag;
use images::Images;
use kinds::Kind;
use robot::Robot;
use std::path::Path;
use topics::{Topic, list};

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
        read(path, options, Some(detect))?.still(path, options)?.with_cameras(&path.display().to_string(), options)
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
    let is_of_messages = detect.is_none();
    let files = folder::files(path)?;
    let mut images = Images::new(path, &options.bag, detect);
    let mut notes = messages::visit(&files, &mut images)?;
    let cut_off = notes.first().cloned();
    notes.extend(images.finish()?);
    let mut of_cameras = Vec::new();
    let (cameras, camera_of_source) = cameras::cameras(path, &mut images, options, &mut of_cameras)?;
    let groups = groups(&images.images, &camera_of_source, options.bag.join.map(nanoseconds));
    if groups.is_empty() {
        let problem = nothing(&images.topics, &options.bag, is_of_messages, cut_off);
        return Err(Error::Unusable(format!("{}: {problem}", path.display())));
    }
    let robot = Robot::new(path, options, &images)?;
    let moments = moments(&groups, &images.images);
    // By the robot's clock.
    let delay = options.joint_delay.map_or(0, nanoseconds);
    let theirs = moments.iter().map(|moment| moment.saturating_sub(delay)).collect();
    let (whereabouts, messages) = robot.read(&files, theirs)?;
    let whereabouts = Whereabouts { moments, ..whereabouts };
    let (groups, apart) = match options.bag.join {
        Some(_) => (groups, 0),
        None => split(groups, &images.images, |first, last| whereabouts.moved(first, last)),
    };
    let whereabouts = whereabouts.of(&groups);
    notes.append(&mut of_cameras);
    notes.extend(note_on_groups(&groups, apart));
    if images.not_finite > 0 {
        notes.push(format!("{} detections are no numbers, and are left out", images.not_finite));
    }
    notes.extend(robot.notes(&whereabouts, &messages, &images));
    let joints = whereabouts.joints.into_iter().map(|joints| joints.map(|at| at.value));
    let states = joints.zip(whereabouts.poses.into_iter().map(|pose| pose.map(|at| at.value)));
    let (samples, features, twice) = samples(&groups, images.images, images.features.names, &camera_of_source, states);
    if twice > 0 {
        notes.push(format!("{twice} detections are of a feature that the same image has already, and are left out"));
    }
    let mut recording = Recording { joints: robot.joint_names, cameras, features, samples };
    let file = path.display().to_string();
    let described = recording.describe_those_there(&options.cameras);
    described.map_err(|problem| Error::Unusable(format!("{file}: {problem}")))?;
    Ok(Opened { recording: recording.checked_as(&file)?, notes, images: Vec::new() })
}

/// Why a bag without images that show anything is none; `cut_off`: where it ends early.
fn nothing(topics: &[Topic], options: &BagOptions, is_of_messages: bool, cut_off: Option<String>) -> String {
    let wanted = if is_of_messages {
        "image with features (apriltag_msgs/AprilTagDetectionArray or vision_msgs/Detection2DArray)"
    } else {
        "compressed image (sensor_msgs/CompressedImage) that shows what is looked for"
    };
    let on_topics = if options.camera_topics.is_empty() { "" } else { " on the topics of --camera-topic" };
    let has_images = topics.iter().any(|topic| topic.kind == Some(Kind::CompressedImage));
    let would_do = if is_of_messages && has_images { "; `handeye detect` looks at compressed images" } else { "" };
    let cut_off = cut_off.map_or_else(String::new, |note| format!(", and it {note}"));
    format!("has no {wanted}{on_topics}; it has {}{cut_off}{would_do}", list(topics))
}

fn note_on_groups(groups: &[Group], apart: usize) -> Vec<String> {
    let spread = groups.iter().map(|group| group.spread).max().filter(|spread| *spread > 0);
    let spread = spread.map(|spread| format!("images that make one sample are up to {:.6} s apart", seconds(spread)));
    let apart = note_on_apart(apart).map(|note| format!("{note} (--join S makes one of all within S seconds)"));
    spread.into_iter().chain(apart).collect()
}
