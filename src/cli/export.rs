//! `handeye export`: a rig as a file that others read.
use super::answer::{Answer, remark};
use super::inputs::{RigInput, check_output, read_rig, write_output};
use clap::{Args, ValueEnum};
use handeye::Error;
use handeye::export::{note_on_unit, to_camchain, to_intrinsics, to_static_transforms, to_tf, to_urdf};
use handeye::intrinsics::{Intrinsics, to_camera_info, to_opencv};
use handeye::rig::{Rig, files_named, read_text};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use handeye::solvers::nalgebra::Vector3;
use serde_json::json;
use std::path::PathBuf;

/// Write what a rig says as a file that others read
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye export learned.toml --to urdf --urdf arm.urdf -o calibrated.urdf   the same file with calibrated joint origins
  handeye export arm.toml --to dh                                            a URDF's arm as Denavit-Hartenberg rows
  handeye export learned.toml --to camera-info --camera left -o left.yaml
  handeye export learned.toml --to static-transforms                         lines to run or to put into a launch file
  handeye export learned.toml --to tf --base-frame panda_link0 --tip-frame panda_link8
  handeye export learned.toml --to tf --camera-frame left=left_link,0,0.015,0,-0.5,0.5,-0.5,0.5
                                             left_link in place of the optical frame, which the camera's driver puts below it")]
pub struct Export {
    /// A rig file, or the name of a shipped rig
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// What to write
    #[arg(long, value_name = "FORMAT")]
    to: Format,
    /// The URDF that the rig began as, for --to urdf
    #[arg(long, value_name = "FILE", required_if_eq("to", "urdf"))]
    urdf: Option<PathBuf>,
    /// The camera, for --to camera-info and opencv, where the rig has several
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// What the base is called, for --to tf and static-transforms [default: the base link of the rig's URDF, else base]
    #[arg(long, value_name = "NAME")]
    base_frame: Option<String>,
    /// What the tip is called, likewise [default: the tip link of the rig's URDF, else tip]
    #[arg(long, value_name = "NAME")]
    tip_frame: Option<String>,
    /// What a camera's frame is called, likewise; with numbers: the frame of its driver that stands above the optical one, and where the optical one
    /// is in it, as `tf2_echo FRAME OPTICAL` prints [default: the optical frame, by the camera's name]
    #[arg(long, value_name = "CAMERA=FRAME[,X,Y,Z,QX,QY,QZ,QW]", value_parser = camera_frame, allow_hyphen_values = true)]
    camera_frame: Vec<CameraFrame>,
    /// The file to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What stands for a camera in transforms.
#[derive(Clone)]
struct CameraFrame {
    camera: String,
    frame: String,
    /// Of the optical frame in it.
    optical: Pose,
}

fn camera_frame(text: &str) -> Result<CameraFrame, String> {
    let expected = "expected CAMERA=FRAME or CAMERA=FRAME,X,Y,Z,QX,QY,QZ,QW";
    let (camera, rest) = text.split_once('=').ok_or(expected)?;
    let mut parts = rest.split(',');
    let frame = parts.next().filter(|frame| !frame.is_empty()).ok_or(expected)?;
    let numbers: Vec<f64> = parts.map(|part| part.trim().parse().map_err(|_| expected)).collect::<Result<_, _>>()?;
    let optical = match numbers[..] {
        [] => Pose::identity(),
        [x, y, z, qx, qy, qz, qw] if numbers.iter().all(|number| number.is_finite()) => {
            if (qx * qx + qy * qy + qz * qz + qw * qw - 1.0).abs() > NEARLY {
                return Err("QX,QY,QZ,QW are no quaternion of length 1".to_owned());
            }
            Pose { rotation: so3::from_quaternion([qx, qy, qz, qw]), translation: Vector3::new(x, y, z) }
        }
        _ => return Err(expected.to_owned()),
    };
    Ok(CameraFrame { camera: camera.to_owned(), frame: frame.to_owned(), optical })
}

/// What the square of a quaternion's length may be off, as it was printed to three digits.
const NEARLY: f64 = 0.01;

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// The URDF of --urdf with the rig's joint origins; everything else in it stays as it is
    Urdf,
    /// A rig file with the arm as Denavit-Hartenberg rows
    Dh,
    /// A camera's intrinsics as ROS camera_info (YAML)
    CameraInfo,
    /// A camera's intrinsics as OpenCV's FileStorage reads them (YAML)
    Opencv,
    /// All cameras as a Kalibr camchain (YAML)
    Kalibr,
    /// Poses of the base and the cameras as a tf2_msgs/TFMessage (YAML)
    Tf,
    /// The same as command lines of static_transform_publisher (ROS 2)
    StaticTransforms,
}

impl Export {
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        if let Some(output) = &self.output {
            let given = [Some(&self.rig), self.urdf.as_ref()].into_iter().flatten().cloned();
            let inputs: Vec<PathBuf> = given.chain(files_named(&self.rig)).collect();
            check_output(output, &inputs)?;
        }
        let text = self.text(&input)?;
        // Calibration files of single cameras have no lengths, and a rig file says itself what its lengths are.
        let has_none = matches!(self.to, Format::Dh | Format::CameraInfo | Format::Opencv);
        let note = note_on_unit(&input.rig).filter(|_| !has_none);
        let optical = self.optical(&input.rig);
        optical.iter().for_each(|note| remark(note));
        note.iter().for_each(|note| remark(&format!("{}: {note}", input.name)));
        let output = self.output.as_ref().map(|path| path.display().to_string());
        let mut json = json!({ "rig": input.name, "output": output, "note": note, "optical": optical });
        let Some(output) = &self.output else {
            json["text"] = json!(text);
            return Ok(Answer::new(text, json));
        };
        write_output(output, &text)?;
        Ok(Answer::new(format!("{} is written\n", output.display()), json))
    }

    /// A remark on frames that a driver has below another, by ROS's names for such.
    fn optical(&self, rig: &Rig) -> Option<String> {
        let is_named = |name: &str| self.camera_frame.iter().any(|of| of.camera == name);
        let mut optical =
            rig.cameras.iter().map(|camera| camera.name.as_str()).filter(|name| name.ends_with("_optical_frame"));
        let name = optical
            .find(|name| !is_named(name))
            .filter(|_| matches!(self.to, Format::Tf | Format::StaticTransforms))?;
        Some(format!(
            "a frame has one parent: where the camera's driver publishes `{name}` below a frame of its own, --camera-frame gives the pose of that one"
        ))
    }

    fn text(&self, RigInput { rig, text, .. }: &RigInput) -> Result<String, Error> {
        if self.urdf.is_some() && !matches!(self.to, Format::Urdf) {
            return Err(Error::Unusable("--urdf is for --to urdf".into()));
        }
        if self.camera.is_some() && !matches!(self.to, Format::CameraInfo | Format::Opencv) {
            return Err(Error::Unusable(
                "--camera is for --to camera-info and --to opencv: others take all cameras".into(),
            ));
        }
        let names_frames = self.base_frame.is_some() || self.tip_frame.is_some() || !self.camera_frame.is_empty();
        if names_frames && !matches!(self.to, Format::Tf | Format::StaticTransforms) {
            let problem = "--base-frame, --tip-frame and --camera-frame are for --to tf and --to static-transforms";
            return Err(Error::Unusable(problem.into()));
        }
        match self.to {
            Format::Dh => rig.update_toml(text),
            Format::CameraInfo => to_camera_info(&self.intrinsics(rig)?),
            Format::Opencv => Ok(to_opencv(&self.intrinsics(rig)?)),
            Format::Kalibr => to_camchain(rig),
            Format::Tf => to_tf(&self.with_frames(rig)?),
            Format::StaticTransforms => to_static_transforms(&self.with_frames(rig)?),
            Format::Urdf => {
                let Some(path) = &self.urdf else {
                    return Err(Error::Unusable("--to urdf needs --urdf FILE, the URDF that the rig began as".into()));
                };
                to_urdf(rig, &read_text(path)?, &path.display().to_string())
            }
        }
    }

    /// The rig with base, tip and cameras called as they are elsewhere, and the frames of drivers in place of cameras. Errors: for cameras that it has not.
    fn with_frames(&self, rig: &Rig) -> Result<Rig, Error> {
        let mut rig = rig.clone();
        if self.base_frame.is_some() {
            rig.robot.link.clone_from(&self.base_frame);
        }
        if let (Some(name), Some(last)) = (&self.tip_frame, rig.robot.joints.last_mut()) {
            last.link = Some(name.clone());
        }
        for CameraFrame { camera: name, frame, optical } in &self.camera_frame {
            let names = || rig.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
            let unknown = || Error::Unusable(format!("--camera-frame {name}: the cameras of the rig are {}", names()));
            let index = rig.cameras.iter().position(|camera| camera.name == *name).ok_or_else(unknown)?;
            let camera = &mut rig.cameras[index];
            camera.pose = camera.pose.map(|pose| pose * optical.inverse());
            camera.name.clone_from(frame);
        }
        Ok(rig)
    }

    /// Those of the camera that was named, or of the only one.
    fn intrinsics(&self, rig: &Rig) -> Result<Intrinsics, Error> {
        let is_meant = |name: &str| self.camera.as_ref().is_none_or(|camera| camera == name);
        let mut meant = rig.cameras.iter().filter(|camera| is_meant(&camera.name));
        match (meant.next(), meant.next()) {
            (Some(camera), None) => to_intrinsics(camera),
            _ if rig.cameras.is_empty() => Err(Error::Unusable("the rig has no cameras".into())),
            _ => {
                let names: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
                Err(Error::Unusable(format!("--camera has to name one of the rig's cameras: {}", names.join(", "))))
            }
        }
    }
}
