//! The kinds of messages that a recording is made of, and what is taken from each.
use super::labels::Label;
use super::value::Value;
use crate::geometry::orientation;
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// What a topic carries, by its type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    JointStates,
    CameraInfo,
    /// AprilTags, of apriltag_msgs or apriltag_detector_msgs.
    Tags,
    /// vision_msgs/Detection2DArray.
    Detections,
    Pose,
    Transforms,
    /// PNG or JPEG.
    CompressedImage,
}

impl Kind {
    /// The kind of a message type, `sensor_msgs/msg/JointState` or `sensor_msgs/JointState`.
    pub(super) fn of(type_name: &str) -> Option<Kind> {
        let package = type_name.split('/').next().unwrap_or_default();
        match (package, type_name.rsplit('/').next().unwrap_or_default()) {
            ("sensor_msgs", "JointState") => Some(Kind::JointStates),
            ("sensor_msgs", "CameraInfo") => Some(Kind::CameraInfo),
            ("apriltag_msgs" | "apriltag_detector_msgs", "AprilTagDetectionArray") => Some(Kind::Tags),
            ("vision_msgs", "Detection2DArray") => Some(Kind::Detections),
            ("geometry_msgs", "PoseStamped") => Some(Kind::Pose),
            ("tf2_msgs", "TFMessage") => Some(Kind::Transforms),
            ("sensor_msgs", "CompressedImage") => Some(Kind::CompressedImage),
            _ => None,
        }
    }

    pub(super) fn is_of_images(self) -> bool {
        matches!(self, Kind::Tags | Kind::Detections)
    }

    /// Fields to decode.
    pub(super) fn wanted(self) -> &'static [&'static str] {
        match self {
            Kind::JointStates => &["header.stamp", "name", "position"],
            Kind::CameraInfo => &[
                "header.frame_id",
                "width",
                "height",
                "distortion_model",
                "d",
                "k",
                "p",
                "D",
                "K",
                "P",
                "binning_x",
                "binning_y",
                "roi",
            ],
            Kind::Tags => &["header", "detections.family", "detections.id", "detections.corners"],
            Kind::Detections => &["header", "detections.id", "detections.results", "detections.bbox.center"],
            Kind::Pose => &["header.stamp", "pose"],
            Kind::Transforms => &["transforms"],
            Kind::CompressedImage => &["header", "data"],
        }
    }
}

/// A field that a message has to have.
pub(super) fn need<T>(field: Option<T>, name: &str) -> Result<T, String> {
    field.ok_or_else(|| format!("has no field `{name}` of the usual type"))
}

/// The stamp of a header [ns].
pub(super) fn stamp(message: &Value) -> Result<i64, String> {
    let part = |name: &str| need(message.number(name), name);
    let (seconds, nanoseconds) = (part("header.stamp.sec")?, part("header.stamp.nanosec")?);
    Ok((seconds as i64).saturating_mul(1_000_000_000).saturating_add(nanoseconds as i64))
}

/// The frame of a header; a leading `/` is of ROS 1.
pub(super) fn frame<'a>(message: &Value<'a>) -> &'a str {
    message.text("header.frame_id").unwrap_or_default().trim_start_matches('/')
}

/// What an image shows: `see` takes each feature with its pixel.
pub(super) fn features(kind: Kind, message: &Value, see: &mut impl FnMut(Label, [f64; 2])) -> Result<(), String> {
    let Some(detections) = message.list("detections") else {
        return Err("has no field `detections` of the usual type".to_owned());
    };
    for detection in detections {
        match kind {
            Kind::Tags => {
                let family = detection.text("family").unwrap_or("tag");
                let id = need(detection.number("id"), "detections.id")?;
                corners(detection, |corner, pixel| see(Label::Corner(family, id, corner), pixel))?;
            }
            _ => {
                let centre = need(detection.at("bbox.center"), "detections.bbox.center")?;
                let centre = centre.at("position").unwrap_or(centre);
                let pixel = |axis: &str| need(centre.number(axis), "detections.bbox.center");
                see(Label::Text(need(name(detection), "detections.id")?), [pixel("x")?, pixel("y")?]);
            }
        }
    }
    Ok(())
}

/// The four corners, `float64[8]` or `Point[4]`.
fn corners(detection: &Value, mut see: impl FnMut(usize, [f64; 2])) -> Result<(), String> {
    let field = "detections.corners";
    if let Some(numbers) = detection.numbers("corners") {
        numbers.as_chunks().0.iter().enumerate().for_each(|(corner, pixel)| see(corner, *pixel));
        return Ok(());
    }
    for (corner, point) in need(detection.list("corners"), field)?.iter().enumerate() {
        see(corner, [need(point.number("x"), field)?, need(point.number("y"), field)?]);
    }
    Ok(())
}

/// The identity of a detection, or what it is most probably of.
fn name<'a>(detection: &Value<'a>) -> Option<&'a str> {
    let id = detection.text("id").filter(|id| !id.is_empty());
    id.or_else(|| {
        let first = detection.list("results")?.first()?;
        first.text("hypothesis.class_id").or_else(|| first.text("id"))
    })
}

/// A pose of two parts by their names: its origin, and the quaternion that it is turned by.
pub(super) fn pose(message: &Value, origin: &str, turn: &str) -> Result<Pose, String> {
    let part = |of: &str, axis: &str| need(message.number(&format!("{of}.{axis}")), of);
    let translation = Vector3::new(part(origin, "x")?, part(origin, "y")?, part(origin, "z")?);
    let quaternion = ["x", "y", "z", "w"].map(|axis| part(turn, axis));
    let [x, y, z, w] = quaternion;
    let rotation = orientation::from_quaternion([x?, y?, z?, w?])
        .ok_or_else(|| format!("`{turn}` is no rotation, a quaternion of length 0 or without numbers"))?;
    if !translation.iter().all(|number| number.is_finite()) {
        return Err(format!("`{origin}` has what is no number"));
    }
    Ok(Pose { rotation, translation })
}
