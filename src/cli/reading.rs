//! What of files is meant, for the commands that read recordings.
use super::inputs::read_camera;
use clap::{Args, ValueEnum};
use handeye::Error;
use handeye::recording::{Actions, Angles, BagOptions, Format, OpenOptions, TableOptions, WithoutEffect};
use std::path::{Path, PathBuf};

#[derive(Args, Default)]
pub struct Reading {
    #[command(flatten)]
    of_files: OfFiles,
    /// What `action` holds: positions of the joints to go to, or motions [default: it is left out]
    #[arg(long, value_name = "WHAT", help_heading = OF_TABLES)]
    actions: Option<What>,
}

/// All of them but the one whose name `infer` has for another too.
#[derive(Args, Clone, Default)]
pub struct OfFiles {
    /// Names of the joints from base to tip [default: those of the rig, else of the joint state that has most, or of the columns]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    joints: Vec<String>,
    /// What is known of a camera: the size of its images, or a calibration file (ROS, OpenCV, Kalibr), whose lens replaces any other
    #[arg(long, value_name = "NAME=WIDTHxHEIGHT|FILE")]
    camera: Vec<String>,
    /// Take one sample of each standstill of the robot, and none of its motions
    #[arg(long)]
    still: bool,
    /// Add this to the stamps of the robot's readings, whose clock is that far behind the cameras' [s]
    #[arg(long, value_name = "SECONDS", value_parser = finite, allow_negative_numbers = true)]
    joint_delay: Option<f64>,
    #[command(flatten)]
    bag: OfBags,
    #[command(flatten)]
    table: OfTables,
}

impl Reading {
    /// Refuses all of them, where there is nothing to read.
    pub fn refuse_without_recording(&self) -> Result<(), Error> {
        if !self.of_files.camera.is_empty() {
            return Err(Error::Unusable("no recording is read, where --camera has no effect".to_owned()));
        }
        self.options(&[]).map(drop)
    }

    /// Files that `--camera` names; sizes are taken for some that are not there.
    pub fn lens_files(&self) -> impl Iterator<Item = PathBuf> + '_ {
        self.of_files.camera.iter().filter_map(|text| Some(PathBuf::from(text.split_once('=')?.1)))
    }

    /// What they say of the files that are read. Errors: for those that are nothing to any of the files.
    pub fn options(&self, files: &[&Path]) -> Result<OpenOptions, Error> {
        let OfFiles { joints, camera, still, joint_delay, bag, table } = &self.of_files;
        let options = OpenOptions {
            joints: joints.clone(),
            known_joints: Vec::new(),
            cameras: camera.iter().map(|text| read_camera(text)).collect::<Result<_, _>>()?,
            still: *still,
            joint_delay: *joint_delay,
            bag: bag.options(),
            table: TableOptions {
                angles: table.angles(),
                actions: match self.actions {
                    None => Actions::Unsaid,
                    Some(What::Targets) => Actions::Targets,
                    Some(What::Motions) => Actions::Motions,
                },
                episodes: table.episodes.clone(),
            },
        };
        let formats: Vec<Format> = files.iter().map(|file| Format::of(file)).collect();
        let Some(WithoutEffect { option, .. }) = options.without_effect(&formats) else { return Ok(options) };
        let kind = |format: &Format| match format {
            Format::JsonLines => "a recording",
            Format::Bag => "a bag",
            Format::Csv | Format::Parquet | Format::LeRobot => "a table",
        };
        let kinds = files.iter().zip(&formats).map(|(file, format)| format!("{} is {}", file.display(), kind(format)));
        let kinds = kinds.collect::<Vec<_>>().join(", ");
        let what = if kinds.is_empty() { "no recording is read" } else { &kinds };
        Err(Error::Unusable(format!("{what}, where {} has no effect", argument(option))))
    }
}

impl From<(&OfFiles, Option<What>)> for Reading {
    fn from((of_files, actions): (&OfFiles, Option<What>)) -> Self {
        Reading { of_files: of_files.clone(), actions }
    }
}

const OF_TABLES: &str = "Options of tables";

#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Options of bags")]
pub struct OfBags {
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
    /// Images at most this far apart make one sample [s] [default: half the time between two images, unless the robot moved between them]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    join: Option<f64>,
}

#[derive(Args, Clone, Default)]
#[command(next_help_heading = OF_TABLES)]
pub struct OfTables {
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
    /// The episodes to read [default: all]
    #[arg(long, value_name = "NUMBER,...", value_delimiter = ',')]
    episodes: Vec<u64>,
}

/// What `action` holds.
#[derive(Clone, Copy, ValueEnum)]
pub enum What {
    Targets,
    Motions,
}

impl OfBags {
    fn options(&self) -> BagOptions {
        let camera = |text: &String| match text.split_once('=') {
            Some((topic, name)) => (topic.to_owned(), Some(name.to_owned())),
            None => (text.clone(), None),
        };
        BagOptions {
            joint_topic: self.joint_topic.clone(),
            pose_topic: self.pose_topic.clone(),
            frames: self.base_frame.clone().zip(self.tip_frame.clone()).map(|(base, tip)| [base, tip]),
            camera_topics: self.camera_topic.iter().map(camera).collect(),
            join: self.join,
        }
    }
}

impl OfTables {
    fn angles(&self) -> Angles {
        match &self.degrees {
            Some(named) => Angles::Degrees(named.clone()),
            None if self.radians => Angles::Radians,
            None => Angles::Unsaid,
        }
    }
}

/// What an option of the library is called here.
fn argument(option: &str) -> String {
    match option {
        "frames" => "--base-frame".to_owned(),
        "camera_topics" => "--camera-topic".to_owned(),
        _ => format!("--{}", option.replace('_', "-")),
    }
}

fn finite(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| seconds.is_finite());
    seconds.ok_or_else(|| "must be a number of seconds".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.0..f64::INFINITY).contains(&seconds) => Ok(seconds),
        _ => Err("must be a number of seconds, 0 or more".to_owned()),
    }
}
