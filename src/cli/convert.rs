//! `handeye convert`: a bag as a recording.
use super::answer::Answer;
use super::inputs::check_output;
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::recording::{Bag, BagOptions};
use serde_json::json;
use std::path::PathBuf;

/// Write a ROS 2 bag (MCAP) as a recording (JSON Lines)
///
/// Features are the corners of AprilTags (apriltag_msgs/AprilTagDetectionArray) and the centres of Detection2D (vision_msgs); joints
/// come from sensor_msgs/JointState, intrinsics from sensor_msgs/CameraInfo, tip poses from geometry_msgs/PoseStamped or TF. States are
/// interpolated to the images' stamps. Other commands read .mcap files themselves, with the defaults of this one.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye convert motions.mcap -o motions.jsonl
  handeye convert motions.mcap --joint-topic /left/joint_states --join 0 -o left.jsonl
  handeye convert motions.mcap --base-frame base --tip-frame tool0 -o poses.jsonl")]
pub struct Convert {
    /// An MCAP file
    #[arg(value_name = "BAG")]
    bag: PathBuf,
    /// The topic of joint states, where there are several
    #[arg(long, value_name = "TOPIC")]
    joint_topic: Option<String>,
    /// Names of the joints from base to tip [default: those of the first joint state]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    joints: Vec<String>,
    /// The topic of tip poses (PoseStamped)
    #[arg(long, value_name = "TOPIC")]
    pose_topic: Option<String>,
    /// The frame of the base, for tip poses from TF
    #[arg(long, value_name = "FRAME", requires = "tip_frame")]
    base_frame: Option<String>,
    /// The frame of the tip, for tip poses from TF
    #[arg(long, value_name = "FRAME", requires = "base_frame")]
    tip_frame: Option<String>,
    /// Topics of detections, with the camera's name where it is not that of the frame [default: all]
    #[arg(long, value_name = "TOPIC[=CAMERA],...", value_delimiter = ',')]
    camera_topic: Vec<String>,
    /// Images at most this far apart make one sample [s] [default: half the time between two images]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    join: Option<f64>,
    /// The recording to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl Convert {
    pub fn run(&self) -> Result<Answer, Error> {
        check_output(&self.output, std::slice::from_ref(&self.bag))?;
        let camera = |text: &String| match text.split_once('=') {
            Some((topic, name)) => (topic.to_owned(), Some(name.to_owned())),
            None => (text.clone(), None),
        };
        let options = BagOptions {
            joint_topic: self.joint_topic.clone(),
            joints: self.joints.clone(),
            known_joints: Vec::new(),
            pose_topic: self.pose_topic.clone(),
            frames: self.base_frame.clone().zip(self.tip_frame.clone()).map(|(base, tip)| [base, tip]),
            camera_topics: self.camera_topic.iter().map(camera).collect(),
            join: self.join,
        };
        let Bag { recording, notes } = Bag::read(&self.bag, &options)?;
        recording.write(&self.output)?;
        let detections = recording.samples.iter().map(|sample| sample.pixels.len()).sum::<usize>();
        let text = format!(
            "{}: {} of {}, {} with {}, {}\n{}",
            self.output.display(),
            count(recording.samples.len(), "sample"),
            count(recording.joints.len(), "joint"),
            count(recording.cameras.len(), "camera"),
            count(recording.features.len(), "feature"),
            count(detections, "detection"),
            notes.iter().map(|note| format!("  {note}\n")).collect::<String>()
        );
        let json = json!({
            "output": self.output.display().to_string(),
            "samples": recording.samples.len(),
            "joints": recording.joints,
            "cameras": recording.cameras.iter().map(|camera| &camera.name).collect::<Vec<_>>(),
            "features": recording.features.len(),
            "detections": detections,
            "notes": notes,
        });
        Ok(Answer::new(text, json))
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.0..f64::INFINITY).contains(&seconds) => Ok(seconds),
        _ => Err("must be a number of seconds, 0 or more".to_owned()),
    }
}
