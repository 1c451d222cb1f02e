//! `handeye convert`: a bag or a table as a recording.
use super::answer::Answer;
use super::inputs::{check_output, read_camera};
use super::written::written;
use clap::{Args, ValueEnum};
use handeye::Error;
use handeye::recording::{Actions, Angles, Bag, BagOptions, Format, Opened, Recording, Table, TableOptions};
use std::path::PathBuf;

/// Write a ROS 2 bag, a CSV file or a LeRobot dataset as a recording (JSON Lines)
///
/// Other commands read these files themselves, by the endings of their names, with the defaults of this one.
///
/// Bags (.mcap): features are the corners of AprilTags (apriltag_msgs/AprilTagDetectionArray) and the centres of Detection2D (vision_msgs);
/// joints come from sensor_msgs/JointState, intrinsics from sensor_msgs/CameraInfo, tip poses from geometry_msgs/PoseStamped or TF. States
/// are interpolated to the images' stamps.
///
/// Tables (.csv, .tsv, .parquet): a row is a sample, a column one quantity, by its name: time (time_ms, time_ns), joints.NAME [rad or m]
/// (joints.NAME_deg), pose.x .y .z .qx .qy .qz .qw (or .roll .pitch .yaw), CAMERA.FEATURE.u and .v [px], CAMERA.FEATURE.x .y .z [m],
/// CAMERA.TARGET.x .. .qw, joint_action.NAME. Empty is not measured. LeRobot's observation.state are joints, which `--degrees` takes for degrees; a
/// folder is a whole LeRobot dataset.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye convert motions.mcap -o motions.jsonl
  handeye convert motions.mcap --joint-topic /left/joint_states --join 0 -o left.jsonl
  handeye convert motions.mcap --base-frame base --tip-frame tool0 -o poses.jsonl
  handeye convert motions.csv --joints q1,q2,q3 --degrees --camera left=640x480 -o motions.jsonl
  handeye convert so100_dataset --degrees --joints shoulder_pan,shoulder_lift,elbow_flex,wrist_flex,wrist_roll -o motions.jsonl")]
pub struct Convert {
    /// A bag (.mcap), a table (.csv, .tsv, .parquet) or the folder of a LeRobot dataset
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// Names of the joints from base to tip [default: those of the first joint state, or of the columns]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    joints: Vec<String>,
    #[command(flatten)]
    bag: OfBags,
    #[command(flatten)]
    table: OfTables,
    /// The recording to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Args)]
#[command(next_help_heading = "Options of bags")]
struct OfBags {
    /// The topic of joint states, where there are several
    #[arg(long, value_name = "TOPIC")]
    joint_topic: Option<String>,
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
}

#[derive(Args)]
#[command(next_help_heading = "Options of tables")]
struct OfTables {
    /// Take joints for degrees: these, or all
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        num_args = 0..,
        require_equals = true,
        conflicts_with = "radians"
    )]
    degrees: Option<Vec<String>>,
    /// Take joints for radians (or metres) even beyond two turns
    #[arg(long)]
    radians: bool,
    /// What `action` holds: positions of the joints to go to, or motions [default: it is left out]
    #[arg(long, value_name = "WHAT")]
    actions: Option<What>,
    /// The episodes to read [default: all]
    #[arg(long, value_name = "NUMBER,...", value_delimiter = ',')]
    episodes: Vec<u64>,
    /// What is known of a camera: the size of its images, or a calibration file (ROS, OpenCV, Kalibr)
    #[arg(long, value_name = "NAME=WIDTHxHEIGHT|FILE")]
    camera: Vec<String>,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    Targets,
    Motions,
}

impl Convert {
    pub fn run(&self) -> Result<Answer, Error> {
        check_output(&self.output, std::slice::from_ref(&self.input))?;
        let format = Format::of(&self.input);
        let (without_effect, kind) = match format {
            Format::JsonLines => {
                // Whoever has a recording already is told so by its errors, or gets it as handeye writes it.
                (
                    self.bag.given().or(self.table.given()).or((!self.joints.is_empty()).then_some("--joints")),
                    "a recording",
                )
            }
            Format::Bag => (self.table.given(), "a bag"),
            Format::Csv | Format::Parquet | Format::LeRobot => (self.bag.given(), "a table"),
        };
        if let Some(option) = without_effect {
            return Err(Error::Unusable(format!("{}: is {kind}, where {option} has no effect", self.input.display())));
        }
        let Opened { recording, notes, .. } = match format {
            Format::JsonLines => {
                Opened { recording: Recording::read(&self.input)?, notes: Vec::new(), images: Vec::new() }
            }
            Format::Bag => Bag::read(&self.input, &self.bag.options(&self.joints))?.into(),
            Format::Csv => Table::read_csv(&self.input, &self.table.options(&self.joints)?)?.into(),
            Format::Parquet => Table::read_parquet(&self.input, &self.table.options(&self.joints)?)?.into(),
            Format::LeRobot => Table::read_lerobot(&self.input, &self.table.options(&self.joints)?)?.into(),
        };
        recording.write(&self.output)?;
        Ok(written(&self.output, &recording, &notes))
    }
}

impl OfBags {
    /// The first option that is given.
    fn given(&self) -> Option<&'static str> {
        let options = [
            (self.joint_topic.is_some(), "--joint-topic"),
            (self.pose_topic.is_some(), "--pose-topic"),
            (self.base_frame.is_some(), "--base-frame"),
            (!self.camera_topic.is_empty(), "--camera-topic"),
            (self.join.is_some(), "--join"),
        ];
        options.into_iter().find(|(is_given, _)| *is_given).map(|(_, name)| name)
    }

    fn options(&self, joints: &[String]) -> BagOptions {
        let camera = |text: &String| match text.split_once('=') {
            Some((topic, name)) => (topic.to_owned(), Some(name.to_owned())),
            None => (text.clone(), None),
        };
        BagOptions {
            joint_topic: self.joint_topic.clone(),
            joints: joints.to_vec(),
            known_joints: Vec::new(),
            pose_topic: self.pose_topic.clone(),
            frames: self.base_frame.clone().zip(self.tip_frame.clone()).map(|(base, tip)| [base, tip]),
            camera_topics: self.camera_topic.iter().map(camera).collect(),
            cameras: Vec::new(),
            join: self.join,
        }
    }
}

impl OfTables {
    /// The first option that is given.
    fn given(&self) -> Option<&'static str> {
        let options = [
            (self.degrees.is_some(), "--degrees"),
            (self.radians, "--radians"),
            (self.actions.is_some(), "--actions"),
            (!self.episodes.is_empty(), "--episodes"),
            (!self.camera.is_empty(), "--camera"),
        ];
        options.into_iter().find(|(is_given, _)| *is_given).map(|(_, name)| name)
    }

    fn options(&self, joints: &[String]) -> Result<TableOptions, Error> {
        Ok(TableOptions {
            joints: joints.to_vec(),
            known_joints: Vec::new(),
            angles: match &self.degrees {
                Some(named) => Angles::Degrees(named.clone()),
                None if self.radians => Angles::Radians,
                None => Angles::Unsaid,
            },
            actions: match self.actions {
                None => Actions::Unsaid,
                Some(What::Targets) => Actions::Targets,
                Some(What::Motions) => Actions::Motions,
            },
            episodes: self.episodes.clone(),
            cameras: self.camera.iter().map(|text| read_camera(text)).collect::<Result<_, _>>()?,
        })
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.0..f64::INFINITY).contains(&seconds) => Ok(seconds),
        _ => Err("must be a number of seconds, 0 or more".to_owned()),
    }
}
