//! ROS camera_info: the YAML of camera_calibration and camera_info_manager, and sensor_msgs/CameraInfo as `ros2 topic echo` prints it.
use super::Intrinsics;
use super::parts::{list, read_distortion, read_matrix, read_model, read_size};
use super::yaml::{Document, Node};
use crate::Error;
use crate::camera::CameraModel;
use std::fmt::Write;

const MATRIX: &[&str] = &["camera_matrix", "k", "K"];
const DISTORTION: &[&str] = &["distortion_coefficients", "d", "D"];

pub(super) fn read(document: &Document) -> Result<Intrinsics, Error> {
    let root = &document.root;
    refuse_parts_of_images(document, root)?;
    let model = read_model(document, document.need(root, "distortion_model")?)?;
    let matrix = root.any(MATRIX).ok_or_else(|| document.error(root, "has no `camera_matrix` (or `k`)"))?;
    let (focal, centre) = read_matrix(document, matrix)?;
    let coefficients = root.any(DISTORTION).map(|node| read_distortion(document, node, model)).transpose()?;
    Ok(Intrinsics {
        name: root.get("camera_name").and_then(Node::text).map(str::to_owned),
        size: read_size(document, root, [&["image_width", "width"], &["image_height", "height"]])?,
        model,
        focal,
        centre,
        distortion: coefficients.unwrap_or_default(),
    })
}

/// The camera matrix is that of the whole image in full resolution, and pixels would be others.
fn refuse_parts_of_images(document: &Document, root: &Node) -> Result<(), Error> {
    let roi = |key| root.get("roi").and_then(|roi| roi.get(key));
    let parts = [root.get("binning_x"), root.get("binning_y"), roi("x_offset"), roi("y_offset")];
    for (node, least) in parts.into_iter().zip([1.0, 1.0, 0.0, 0.0]) {
        if let Some(node) = node
            && document.number(node)? > least
        {
            return Err(
                document.error(node, "images are binned or cut out, and the camera matrix is that of whole ones")
            );
        }
    }
    Ok(())
}

/// The YAML that camera_info_manager loads.
///
/// Errors: [`Error::Unusable`] where the camera has no size.
pub fn to_camera_info(camera: &Intrinsics) -> Result<String, Error> {
    let [width, height] = camera.need_size("camera_info")?;
    let (model, n) = match camera.model {
        CameraModel::Pinhole | CameraModel::BrownConrady => ("plumb_bob", 5),
        CameraModel::Rational => ("rational_polynomial", 8),
        CameraModel::KannalaBrandt => ("equidistant", 4),
    };
    let [fx, _, cx, _, fy, cy, ..] = camera.matrix();
    let projection = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let mut text = format!("image_width: {width}\nimage_height: {height}\n");
    // Writing to a string cannot fail.
    let _ = writeln!(text, "camera_name: {:?}", camera.name.as_deref().unwrap_or("camera"));
    let mut matrix = |name: &str, rows: usize, data: &[f64]| {
        let _ = write!(text, "{name}:\n  rows: {rows}\n  cols: {}\n  data: {}\n", data.len() / rows, list(data));
    };
    matrix("camera_matrix", 3, &camera.matrix());
    matrix("distortion_coefficients", 1, &camera.coefficients(n));
    matrix("rectification_matrix", 3, &identity);
    matrix("projection_matrix", 3, &projection);
    text.insert_str(
        text.find("distortion_coefficients").unwrap_or(text.len()),
        &format!("distortion_model: {model}\n"),
    );
    Ok(text)
}
