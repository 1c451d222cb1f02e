//! Where each camera of a learned rig is on what it is mounted on, in the units that people write down, and how well that is known.
use super::report::{Calibration, length_in_words};
use super::sources::Sources;
use super::{deviations, gauge};
use crate::rig::{Camera, Parameter, Parent, Rig, matches};
use handeye_solvers::manifold::so3;

/// Of two standard deviations, the smaller is told too where it is below this share of the other.
const ALIKE: f64 = 0.9;

/// The pose of a camera against what it is mounted on.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPose {
    /// The camera's name.
    pub camera: String,
    /// What it is mounted on, as "the tip" or "link elbow".
    pub on: String,
    /// Its centre [m, or the model's unit].
    pub xyz: [f64; 3],
    /// Its rotation vector [rad].
    pub turn: [f64; 3],
    /// Standard deviations of centre and rotation, length [m, or the model's unit] and angle [rad], with what is `assumed` taken as it is;
    /// `None` where the pose is held or left open.
    pub sd: Option<[f64; 2]>,
    /// What the standard deviation of the centre comes from; `None` where that is not known.
    pub sources: Option<Sources>,
    /// Paths of joints' numbers that place the frame of what it is mounted on along and about an axis. No image depends on them, so they are
    /// known from priors alone.
    pub assumed: Vec<String>,
    /// What holds them, as few patterns of paths as may be: the joint as a whole where nothing else of it was learned.
    pub hold: Vec<String>,
    /// The same standard deviations with those of the priors of what is `assumed`; those of `sd` where nothing is.
    pub sd_with_assumed: Option<[f64; 2]>,
    /// True where lengths are metres.
    pub metric: bool,
}

/// Of every camera that has a pose, in the order of the learned rig.
pub fn camera_poses(calibration: &Calibration) -> Vec<CameraPose> {
    let Calibration { rig, report } = calibration;
    let of_camera = |(index, camera): (usize, &Camera)| {
        let pose = camera.pose?;
        let sds = rig.fit.as_ref().and_then(|fit| fit.sd.get(&format!("cameras.{}.pose", camera.name)));
        let size = |sds: &[f64]| sds.iter().map(|sd| sd * sd).sum::<f64>().sqrt();
        let whole = sds.filter(|sds| sds.len() == 6).map(|sds| [size(&sds[..3]), size(&sds[3..])]);
        let is_less = |less: &[f64; 2], whole: [f64; 2]| less[0] > 0.0 && (0..2).any(|k| less[k] < ALIKE * whole[k]);
        let against_arm = report.camera_poses.get(index).filter(|_| whole.is_some());
        let sd = against_arm.map(|of| [of.length, of.angle]).or(whole);
        let is_less = sd.zip(whole).is_some_and(|(sd, whole)| is_less(&sd, whole));
        let assumed = if is_less { of_frame(rig, camera.parent) } else { Vec::new() };
        Some(CameraPose {
            camera: camera.name.clone(),
            on: mount(rig, camera.parent),
            xyz: pose.translation.into(),
            turn: so3::log(&pose.rotation).into(),
            sd,
            sources: against_arm.map(|of| of.sources),
            hold: patterns(rig, &assumed),
            assumed,
            sd_with_assumed: whole,
            metric: report.metric,
        })
    };
    rig.cameras.iter().enumerate().filter_map(of_camera).collect()
}

/// The same in words, one sentence each, and then what is assumed of them: of all at once where that is the same.
pub fn camera_poses_in_words(calibration: &Calibration) -> Vec<String> {
    let poses = camera_poses(calibration);
    let mut words: Vec<String> = poses.iter().map(CameraPose::in_short).collect();
    if poses.iter().any(|pose| pose.sd.is_some()) {
        words.push("± is one standard deviation; the squares of what it comes from add up to its square".to_owned());
    }
    let mut told: Vec<&[String]> = Vec::new();
    for pose in poses.iter().filter(|pose| !pose.assumed.is_empty()) {
        if !told.contains(&&pose.assumed[..]) {
            told.push(&pose.assumed);
            let alike: Vec<&CameraPose> = poses.iter().filter(|other| other.assumed == pose.assumed).collect();
            words.extend(assumed_in_words(&alike));
        }
    }
    words
}

/// What is assumed of poses, the same of all of them, and what to do about it; `None` where nothing is.
fn assumed_in_words(poses: &[&CameraPose]) -> Option<String> {
    let first = poses.first().filter(|pose| !pose.assumed.is_empty())?;
    let known = |pose: &&CameraPose| {
        let [length, angle] = pose.sd_in_words(pose.sd_with_assumed?);
        let of = if poses.len() > 1 { format!(" (`{}`)", pose.camera) } else { String::new() };
        Some(format!("{length} and {angle}{of}"))
    };
    let known: Vec<String> = poses.iter().filter_map(known).collect();
    let (takes, is_known) =
        if poses.len() > 1 { ("These take", "the poses are") } else { ("This takes", "the pose is") };
    let (they_are, them) = if first.assumed.len() > 1 { ("they are", "them") } else { ("it is", "it") };
    let quoted: Vec<String> = first.hold.iter().map(|path| format!("\"{path}\"")).collect();
    Some(format!(
        "{takes} {} as given, since no image shows {them}; as uncertain as {they_are} assumed to be, {is_known} known to {}. Where {they_are} as in \
         the data sheet, hold {them}: `--hold {}`, or `fixed = [{}]` under `[estimate]` of a rig file",
        first.assumed.join(", "),
        known.join(", "),
        first.hold.join(","),
        quoted.join(", ")
    ))
}

/// Patterns that cover these numbers of one joint and no others that were learned.
fn patterns(rig: &Rig, assumed: &[String]) -> Vec<String> {
    let Some((joint, _)) = assumed.first().and_then(|path| path.rsplit_once('.')) else { return Vec::new() };
    let mut learned = rig.fit.iter().flat_map(|fit| fit.sd.keys()).filter(|path| matches(joint, path));
    if learned.all(|path| assumed.contains(path)) { vec![joint.to_owned()] } else { assumed.to_vec() }
}

/// What a camera's pose is against.
fn mount(rig: &Rig, parent: Parent) -> String {
    match parent {
        Parent::Tip => "the tip".to_owned(),
        Parent::Link(joint) => format!("link {}", rig.robot.joints[joint].name),
        Parent::World
            if rig.robot.base.is_some_and(|base| so3::log(&base.rotation).norm() + base.translation.norm() < 1e-12) =>
        {
            "the base".to_owned()
        }
        Parent::World => "the world's origin".to_owned(),
    }
}

/// Numbers that were learned, though nothing that is seen depends on how they place a frame.
fn of_frame(rig: &Rig, parent: Parent) -> Vec<String> {
    let (first, last) = gauge::ends(rig.robot.convention);
    let (joint, coordinates) = match parent {
        Parent::World => (0, first),
        Parent::Tip => (rig.robot.joints.len().saturating_sub(1), last),
        Parent::Link(_) => return Vec::new(),
    };
    let is_learned = |path: &String| rig.fit.as_ref().is_some_and(|fit| fit.sd.contains_key(path));
    let of_joint = rig.parameters().into_iter().filter(|parameter| match parameter {
        Parameter::JointField { joint: of, field } => {
            *of == joint && coordinates.contains(&deviations::coordinate_of(*field))
        }
        _ => false,
    });
    of_joint.map(|parameter| parameter.path(rig)).filter(is_learned).collect()
}

impl CameraPose {
    /// Centre in mm, or in the model's unit.
    pub fn centre_in_words(&self) -> String {
        let number = |x: f64| if self.metric { format!("{:.1}", 1e3 * x) } else { format!("{x:.4}") };
        format!("{}{}", self.xyz.map(number).join(", "), if self.metric { " mm" } else { "" })
    }

    /// Rotation vector in degrees.
    pub fn turn_in_words(&self) -> String {
        format!("{}°", self.turn.map(|angle| format!("{:.2}", angle.to_degrees())).join(", "))
    }

    /// Without what is assumed.
    fn in_short(&self) -> String {
        let unit = if self.metric { "" } else { ", in the model's unit" };
        let [length, angle] =
            self.sd.map_or([String::new(), String::new()], |sd| self.sd_in_words(sd).map(|sd| format!(", {sd}")));
        let parts = self.sources.map_or_else(String::new, |sources| sources.in_words(self.metric, true));
        let parts = if parts.is_empty() { parts } else { format!(" ({parts})") };
        let (camera, on, centre, turn) = (&self.camera, &self.on, self.centre_in_words(), self.turn_in_words());
        format!("camera `{camera}`: {centre} from {on}{unit}{length}{parts}; turned by {turn} (rotation vector){angle}")
    }

    /// A standard deviation of the centre, and one of the rotation.
    pub fn sd_in_words(&self, [length, angle]: [f64; 2]) -> [String; 2] {
        [format!("± {}", length_in_words(length, self.metric)), format!("± {:.3}°", angle.to_degrees())]
    }
}

impl std::fmt::Display for CameraPose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.in_short())?;
        assumed_in_words(&[self]).map_or(Ok(()), |assumed| write!(f, ". {assumed}"))
    }
}
