//! `handeye convert`: a bag or a table as a recording.
use super::answer::Answer;
use super::inputs::check_output;
use super::reading::Reading;
use super::written::written;
use clap::Args;
use handeye::Error;
use handeye::recording::{Opened, Recording};
use std::path::PathBuf;

/// Write a ROS 2 bag, a CSV file or a LeRobot dataset as a recording (JSON Lines)
///
/// Other commands read these files themselves, by the endings of their names, and calibrate, check, evaluate, infer, monitor and suggest take the same
/// options.
///
/// Bags (.mcap, or the folder that ros2 bag record makes): features are the corners of AprilTags (apriltag_msgs/AprilTagDetectionArray) and the centres of Detection2D (vision_msgs);
/// joints come from sensor_msgs/JointState, intrinsics from sensor_msgs/CameraInfo, tip poses from geometry_msgs/PoseStamped or TF. States
/// are interpolated to the images' stamps.
///
/// Tables (.csv, .tsv, .parquet): a row is a sample, a column one quantity, by its name: time (time_ms, time_ns), joints.NAME [rad or m]
/// (joints.NAME_deg), pose.x .y .z .qx .qy .qz .qw (or .roll .pitch .yaw), CAMERA.FEATURE.u and .v [px], CAMERA.FEATURE.x .y .z [m],
/// CAMERA.TARGET.x .. .qw, joint_action.NAME. Empty is not measured. LeRobot's observation.state are joints, which `--degrees` takes for degrees, and
/// its action are commands of the joints of the same names, where `--actions` says which; a folder is a whole LeRobot dataset.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye convert motions.mcap -o motions.jsonl
  handeye convert motions.mcap --joint-topic /left/joint_states --join 0 -o left.jsonl
  handeye convert motions.mcap --base-frame base --tip-frame tool0 -o poses.jsonl
  handeye convert motions.csv --joints q1,q2,q3 --degrees --camera left=640x480 -o motions.jsonl
  handeye convert so100_dataset --degrees --joints shoulder_pan,shoulder_lift,elbow_flex,wrist_flex,wrist_roll -o motions.jsonl")]
pub struct Convert {
    /// A bag (.mcap, or its folder), a table (.csv, .tsv, .parquet), the folder of a LeRobot dataset, or a recording of which a part is meant
    #[arg(value_name = "FILE")]
    input: PathBuf,
    #[command(flatten)]
    reading: Reading,
    /// The recording to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl Convert {
    pub fn run(&self) -> Result<Answer, Error> {
        check_output(&self.output, std::slice::from_ref(&self.input))?;
        let Opened { recording, notes, .. } =
            Recording::open_with(&self.input, &self.reading.options(&[&self.input])?)?;
        recording.write(&self.output)?;
        Ok(written(&self.output, &recording, &notes))
    }
}
