//! A recording in memory.
use crate::camera::CameraModel;
use crate::rig::Camera;
use handeye_solvers::Pose;
use nalgebra::Matrix6;

/// What was commanded, read and seen while a robot moved. Units: m, rad, s, px.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Names of the joints, from base to tip.
    pub joints: Vec<String>,
    /// The cameras that the header names, in its order.
    pub cameras: Vec<RecordedCamera>,
    /// Names of the features, in natural order (`f2` before `f10`): detections refer to them by index.
    pub features: Vec<String>,
    /// The moments at which something was measured, in order.
    pub samples: Vec<Sample>,
}

/// What the header says of a camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedCamera {
    /// Its name.
    pub name: String,
    /// Width and height of its images [px].
    pub size: Option<[u32; 2]>,
    /// Its lens model, where named.
    pub model: Option<CameraModel>,
    /// Focal length along u [px].
    pub fx: Option<f64>,
    /// Focal length along v [px].
    pub fy: Option<f64>,
    /// Principal point, u [px].
    pub cx: Option<f64>,
    /// Principal point, v [px].
    pub cy: Option<f64>,
    /// Distortion coefficients of the model.
    pub distortion: Option<Vec<f64>>,
}

impl From<&Camera> for RecordedCamera {
    /// What a rig says of the camera, its place apart.
    fn from(camera: &Camera) -> Self {
        RecordedCamera {
            name: camera.name.clone(),
            size: camera.size,
            model: camera.model,
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
            distortion: camera.distortion.clone().filter(|coefficients| !coefficients.is_empty()),
        }
    }
}

/// One moment. What was not measured is `None` or empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time [s].
    pub time: Option<f64>,
    /// Measured joint states, one per joint [rad or m].
    pub joints: Option<Vec<f64>>,
    /// Measured `world_from_tip`.
    pub pose: Option<Pose>,
    /// Commanded joint motion from this sample to the next [rad or m].
    pub joint_action: Option<Vec<f64>>,
    /// Commanded motion A from this sample to the next: `P_next = A P`.
    pub pose_action: Option<Pose>,
    /// Features seen in images, ordered by camera, then feature; each pair at most once.
    pub pixels: Vec<Detection>,
    /// Features seen by depth cameras, ordered likewise.
    pub points: Vec<PointDetection>,
    /// Targets seen by cameras, as poses in the camera frame.
    pub targets: Vec<TargetDetection>,
}

/// A feature in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Index into [`Recording::cameras`].
    pub camera: u32,
    /// Index into [`Recording::features`].
    pub feature: u32,
    /// (u, v) [px].
    pub pixel: [f64; 2],
}

/// A feature in a depth camera's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointDetection {
    /// Index into [`Recording::cameras`].
    pub camera: u32,
    /// Index into [`Recording::features`].
    pub feature: u32,
    /// (x, y, z) in the camera's frame [m].
    pub point: [f64; 3],
}

/// A target (tag or board) in a camera's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetDetection {
    /// Index into [`Recording::cameras`].
    pub camera: u32,
    /// The target's name.
    pub target: String,
    /// `camera_from_target`.
    pub pose: Pose,
    /// Covariance of the pose's error where the detector gives one: of the translation [m], then of the rotation vector [rad],
    /// both along the camera's axes, as in ROS. Symmetric and positive definite.
    pub covariance: Option<Matrix6<f64>>,
}
