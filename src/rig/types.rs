//! A rig in memory. `None` is unknown; what is given is a known value or a starting point.
use crate::camera::CameraModel;
use crate::chain::{Convention, JointKind};
use crate::error::suggestion;
use handeye_solvers::Pose;
use std::collections::BTreeMap;

/// A robot, the cameras that watch it and the features that they track. Units: m, rad, s, px.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// What its author calls it.
    pub name: Option<String>,
    /// The arm.
    pub robot: Robot,
    /// The cameras, in the file's order.
    pub cameras: Vec<Camera>,
    /// The features, in the file's order.
    pub features: Vec<Feature>,
    /// The targets, in the file's order.
    pub targets: Vec<Target>,
    /// Standard deviations of what is measured and commanded.
    pub noise: Noise,
    /// What is held, and what is known only roughly.
    pub estimate: Estimate,
    /// How it was learned, where it was.
    pub fit: Option<Fit>,
}

/// The arm. A rig without joints takes their number from the recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Robot {
    /// How a row of parameters makes a link.
    pub convention: Convention,
    /// `world_from_base`.
    pub base: Option<Pose>,
    /// What the base is called in a URDF.
    pub link: Option<String>,
    /// `base_from_start`, where the first row begins; `None` where that is the base.
    pub start: Option<Pose>,
    /// The joints, from base to tip.
    pub joints: Vec<Joint>,
}

impl Robot {
    /// Names of the joints, from base to tip.
    pub fn joint_names(&self) -> Vec<String> {
        self.joints.iter().map(|joint| joint.name.clone()).collect()
    }
}

/// One joint and the link behind it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Added to the reading of a revolute joint; the constant angle of a prismatic one [rad].
    pub offset: Option<f64>,
    /// Link offset [m]; the reading of a prismatic joint is added to it.
    pub d: Option<f64>,
    /// Link length [m].
    pub a: Option<f64>,
    /// Link twist [rad].
    pub alpha: Option<f64>,
    /// Hayati's extra rotation about y [rad]; `None` where the joint has none, which is 0.
    pub beta: Option<f64>,
    /// True where the reading counts against the axis.
    pub reversed: bool,
    /// How far and how fast it may move.
    pub limits: Limits,
    /// What its link is called in a URDF.
    pub link: Option<String>,
    /// `row_from_link`, the link's own frame in that which the row makes; `None` where they are the same.
    pub frame: Option<Pose>,
}

/// Limits of a joint [rad, rad/s, rad/s², or m in place of rad]; `None` is unlimited or unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Smallest reading.
    pub lower: Option<f64>,
    /// Largest reading.
    pub upper: Option<f64>,
    /// Largest speed.
    pub velocity: Option<f64>,
    /// Largest acceleration.
    pub acceleration: Option<f64>,
}

impl Limits {
    /// True for a reading that the joint could not have had: encoders are noisy and limits rounded, by 0.01 rad or m at most.
    pub(crate) fn exclude(&self, reading: f64) -> bool {
        const BEYOND: f64 = 0.01;
        self.lower.is_some_and(|lower| reading < lower - BEYOND)
            || self.upper.is_some_and(|upper| reading > upper + BEYOND)
    }
}

/// What a camera, a feature or a target is fixed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parent {
    /// The world.
    #[default]
    World,
    /// The link of the joint with this index.
    Link(usize),
    /// The last link.
    Tip,
}

/// One camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Camera {
    /// Its name.
    pub name: String,
    /// Width and height of its images [px].
    pub size: Option<[u32; 2]>,
    /// Its lens model; `None` where the file does not say (a pinhole, or what the recording's header says).
    pub model: Option<CameraModel>,
    /// Focal length along u [px].
    pub fx: Option<f64>,
    /// Focal length along v [px].
    pub fy: Option<f64>,
    /// Principal point, u [px].
    pub cx: Option<f64>,
    /// Principal point, v [px].
    pub cy: Option<f64>,
    /// Distortion coefficients; fewer than the model has are followed by zeros.
    pub distortion: Option<Vec<f64>>,
    /// True for a depth camera, which gives features as points in its frame. Where it has no intrinsics, it gives nothing else.
    pub depth: bool,
    /// What it is fixed to.
    pub parent: Parent,
    /// `parent_from_camera`.
    pub pose: Option<Pose>,
}

/// One feature. The default parent is the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its name.
    pub name: String,
    /// What it is fixed to.
    pub parent: Parent,
    /// Its coordinates in the parent's frame [m].
    pub xyz: Option<[f64; 3]>,
}

/// A target: a tag or a board, which a detector reports as a whole pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Target {
    /// Its name.
    pub name: String,
    /// What it is fixed to.
    pub parent: Parent,
    /// `parent_from_target`.
    pub pose: Option<Pose>,
}

/// Standard deviations. 0 for joints and poses: readings are exact; for actions: nothing was commanded or they are exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Of a pixel coordinate [px].
    pub pixels: f64,
    /// Of a coordinate of a depth camera's point [m].
    pub points: f64,
    /// Of a joint reading [rad or m].
    pub joints: f64,
    /// Of a recorded tip pose.
    pub pose: PoseNoise,
    /// Of a target's pose in a camera's frame; `None` is estimated from how the poses scatter.
    pub target: Option<PoseNoise>,
    /// Of a commanded joint motion [rad or m].
    pub joint_action: f64,
    /// Of a commanded tip motion.
    pub pose_action: PoseNoise,
}

/// Standard deviation of a pose, per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseNoise {
    /// Of each coordinate of the translation [m].
    pub xyz: f64,
    /// Of each coordinate of the rotation vector [rad].
    pub rot: f64,
}

impl PoseNoise {
    /// False where poses are exact.
    pub fn is_noisy(self) -> bool {
        self.xyz > 0.0 || self.rot > 0.0
    }
}

impl Camera {
    /// True where nothing is said of a lens, and the camera gives points alone.
    pub fn gives_points_alone(&self) -> bool {
        self.depth && [self.fx, self.fy, self.cx, self.cy].iter().all(Option::is_none)
    }
}

impl Default for Noise {
    fn default() -> Self {
        Noise {
            pixels: 0.5,
            points: 0.005,
            joints: 0.0,
            pose: PoseNoise::default(),
            target: None,
            joint_action: 0.0,
            pose_action: PoseNoise::default(),
        }
    }
}

/// What is held and what is known roughly, by parameter path (globs as in the rig file).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Paths of parameters that are held at their given values.
    pub fixed: Vec<String>,
    /// Standard deviation of a Gaussian prior around the given value, by path.
    pub prior: BTreeMap<String, f64>,
    /// Distances that were measured.
    pub lengths: Vec<Length>,
    /// Side of all tags whose corners are features, `FAMILY:ID/0` to `/3` around the tag, and its standard deviation [m]: one measurement, as
    /// all come from one printer.
    pub tag_side: Option<[f64; 2]>,
}

/// A distance that was measured, with a ruler or on a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Length {
    /// Between what.
    pub between: Ends,
    /// How long it is [m].
    pub length: f64,
    /// Standard deviation of the measurement [m].
    pub sd: f64,
}

impl Length {
    /// Standard deviation of what a ruler or a drawing tells [m].
    pub const RULER: f64 = 5e-4;
}

/// No side of a tag is longer [m].
const LONGEST_TAG: f64 = 2.0;

impl Estimate {
    /// Takes a measured length, in place of one between the same ends.
    pub fn measure(&mut self, length: Length) {
        self.lengths.retain(|known| known.between != length.between);
        self.lengths.push(length);
    }

    /// What is wrong with the measured side of a tag and its standard deviation [m]; `None` where they may be.
    pub(crate) fn problem_of_tag_side([side, sd]: [f64; 2]) -> Option<String> {
        let is_fine = side > 0.0 && side < LONGEST_TAG && sd > 0.0 && sd.is_finite();
        (!is_fine).then(|| format!("the side of a tag is above 0 and below {LONGEST_TAG} m, its standard deviation above 0; found {side} and {sd} m"))
    }
}

/// The ends of a [`Length`], by name; both are fixed to the same thing.
#[derive(Clone, Debug, PartialEq)]
pub enum Ends {
    /// Two features.
    Features([String; 2]),
    /// The centres of projection of two cameras.
    Cameras([String; 2]),
}

impl Ends {
    /// By their paths: `features.A` and `features.B`, or two `cameras`.
    ///
    /// Errors: in words, where they are neither.
    pub fn new([one, other]: [&str; 2]) -> Result<Ends, String> {
        let both = |prefix: &str| Some([one.strip_prefix(prefix)?.to_owned(), other.strip_prefix(prefix)?.to_owned()]);
        let features = both("features.").map(Ends::Features);
        features.or_else(|| both("cameras.").map(Ends::Cameras)).ok_or_else(|| {
            format!("is between two features or two cameras, as in [\"features.A\", \"features.B\"], found `{one}` and `{other}`")
        })
    }

    /// The word for what they are, and their names.
    pub fn parts(&self) -> (&'static str, &[String; 2]) {
        match self {
            Ends::Features(names) => ("features", names),
            Ends::Cameras(names) => ("cameras", names),
        }
    }

    /// The features or cameras of a rig, with what these are fixed to.
    pub(crate) fn among<'a>(&self, rig: &'a Rig) -> Vec<(&'a str, Parent)> {
        match self {
            Ends::Features(_) => rig.features.iter().map(|feature| (feature.name.as_str(), feature.parent)).collect(),
            Ends::Cameras(_) => rig.cameras.iter().map(|camera| (camera.name.as_str(), camera.parent)).collect(),
        }
    }

    /// What is wrong with them among the features or cameras of a rig, with what these are fixed to; `None` where nothing is.
    pub(crate) fn problem(&self, known: &[(&str, Parent)]) -> Option<String> {
        let (kind, [one, other]) = self.parts();
        let parent = |end: &String| known.iter().find(|(name, _)| name == end).map(|(_, parent)| *parent);
        match (parent(one), parent(other)) {
            _ if one == other => Some(format!("`{kind}.{one}` is at both ends")),
            (Some(of_one), Some(of_other)) if of_one != of_other => Some(format!(
                "`{kind}.{one}` and `{kind}.{other}` are not fixed to the same thing, so that their distance changes as the arm moves"
            )),
            (Some(_), Some(_)) => None,
            (one_parent, _) => {
                let unknown = if one_parent.is_none() { one } else { other };
                Some(format!(
                    "there is no `{kind}.{unknown}` {}",
                    suggestion(unknown, known.iter().map(|(name, _)| *name))
                ))
            }
        }
    }
}

/// "the distance between features `a` and `b`"
impl std::fmt::Display for Ends {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (kind, [one, other]) = self.parts();
        write!(f, "the distance between {kind} `{one}` and `{other}`")
    }
}

/// How a learned rig was learned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fit {
    /// Samples used.
    pub samples: usize,
    /// Detections used.
    pub observations: usize,
    /// Detections left out as wrong.
    pub rejected: usize,
    /// Root mean square of the pixel distances [px].
    pub rms_px: f64,
    /// Mean pixel distance [px].
    pub mean_px: f64,
    /// Root mean square of the distances of a depth camera's points [m]; `None` without such points.
    pub rms_points_m: Option<f64>,
    /// What the data cannot determine, in words, and how it was fixed.
    pub gauge: Vec<String>,
    /// Smallest and largest value of every joint in the samples used [rad or m], in the order of the rig's joints; empty without any.
    pub joints: Vec<[f64; 2]>,
    /// Standard deviation of every learned scalar by parameter path; poses and points have 6 and 3 numbers.
    pub sd: BTreeMap<String, Vec<f64>>,
}

/// How the line of `gauge` begins where nothing metric was known while the rig was learned.
const NO_METRES: &str = "lengths are in units of ";

impl Fit {
    /// The line of `gauge` that names the unit of the rig's lengths; `None` where they are metres.
    pub fn unit(&self) -> Option<&str> {
        self.gauge.iter().map(String::as_str).find(|line| line.starts_with(NO_METRES))
    }
}
