//! OpenCV's calibration files, as cv::FileStorage writes them in YAML.
use super::Intrinsics;
use super::parts::{data, list, read_distortion, read_matrix, read_size};
use super::yaml::{Document, Node};
use crate::Error;
use crate::camera::CameraModel;
use std::fmt::Write;

const MATRIX: &[&str] = &["camera_matrix", "cameraMatrix", "K"];
const DISTORTION: &[&str] = &["distortion_coefficients", "distCoeffs", "dist_coeffs", "D"];

pub(super) fn is_calibration(root: &Node) -> bool {
    root.any(MATRIX).is_some()
}

/// Which model it is shows in the number of coefficients, a fisheye in `fisheye_model`, as OpenCV's own programs write it.
pub(super) fn read(document: &Document) -> Result<Intrinsics, Error> {
    let root = &document.root;
    let matrix = root.any(MATRIX).ok_or_else(|| document.error(root, "has no `camera_matrix`"))?;
    let (focal, centre) = read_matrix(document, matrix)?;
    let is_fisheye = root.get("fisheye_model").is_some_and(|node| node.text() == Some("1"));
    let pinhole = if is_fisheye { CameraModel::KannalaBrandt } else { CameraModel::Pinhole };
    let (mut model, mut distortion) = (pinhole, Vec::new());
    if let Some(node) = root.any(DISTORTION) {
        let n = data(node).items().len();
        model = match n {
            _ if is_fisheye => CameraModel::KannalaBrandt,
            0 => CameraModel::Pinhole,
            4 | 5 => CameraModel::BrownConrady,
            8 | 12 | 14 => CameraModel::Rational,
            _ => return Err(document.error(node, format!("expected 4, 5, 8, 12 or 14 coefficients, found {n}"))),
        };
        distortion = read_distortion(document, node, model)?;
    }
    Ok(Intrinsics {
        name: root.get("camera_name").and_then(Node::text).map(str::to_owned),
        size: read_size(document, root, [&["image_width", "image_Width"], &["image_height", "image_Height"]])?,
        model,
        focal,
        centre,
        distortion,
    })
}

/// A file that cv::FileStorage reads, with the names that OpenCV's calibration program uses.
pub fn to_opencv(camera: &Intrinsics) -> String {
    let mut text = "%YAML:1.0\n---\n".to_owned();
    // Writing to a string cannot fail.
    if let Some([width, height]) = camera.size {
        let _ = write!(text, "image_width: {width}\nimage_height: {height}\n");
    }
    let _ = writeln!(text, "fisheye_model: {}", u8::from(camera.model == CameraModel::KannalaBrandt));
    let n = camera.model.distortion().len().max(4);
    for (name, rows, data) in
        [("camera_matrix", 3, camera.matrix().to_vec()), ("distortion_coefficients", n, camera.coefficients(n))]
    {
        let (cols, data) = (data.len() / rows, list(&data));
        let _ = write!(text, "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: {data}\n");
    }
    text
}
