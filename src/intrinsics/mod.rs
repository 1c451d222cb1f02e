//! Intrinsics of cameras as calibration files say them: ROS camera_info, OpenCV, Kalibr.
//!
//! Pixel (0, 0) is the centre of the top-left pixel in all of them, as it is here, and their distortion coefficients stand in the
//! order of the camera models: plumb_bob and radtan are `BrownConrady`, rational_polynomial is `Rational`, equidistant and
//! fisheye are `KannalaBrandt`.
mod camera_info;
mod kalibr;
mod opencv;
mod parts;
mod yaml;

pub use camera_info::to_camera_info;
pub use kalibr::to_kalibr;
pub use opencv::to_opencv;
pub(crate) use parts::model_of;

use crate::Error;
use crate::camera::CameraModel;
use yaml::Document;

/// What a calibration file says of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Intrinsics {
    /// Its name, where the file has one.
    pub name: Option<String>,
    /// Width and height of its images [px].
    pub size: Option<[u32; 2]>,
    /// Its lens model.
    pub model: CameraModel,
    /// Focal lengths along u and v [px].
    pub focal: [f64; 2],
    /// Principal point [px].
    pub centre: [f64; 2],
    /// Distortion coefficients, as many as the model has or fewer.
    pub distortion: Vec<f64>,
}

/// Intrinsics from the text of a calibration file (YAML), which messages call `file`; its format shows in its keys.
///
/// `camera`: which one, where the file has several (Kalibr's `cam0`, `cam1`).
///
/// Errors: [`Error::Malformed`].
pub fn read_intrinsics(text: &str, file: &str, camera: Option<&str>) -> Result<Intrinsics, Error> {
    let document = Document::parse(text, file)?;
    let root = &document.root;
    if kalibr::is_camchain(root) {
        return kalibr::read(&document, camera);
    }
    if let Some(camera) = camera {
        return Err(
            document.error(root, format!("this is not a Kalibr camchain, and has no camera `{camera}` among others"))
        );
    }
    if root.get("distortion_model").is_some() {
        return camera_info::read(&document);
    }
    if opencv::is_calibration(root) {
        return opencv::read(&document);
    }
    Err(document.error(
        root,
        "this is no camera calibration: expected ROS camera_info (`camera_matrix`, `distortion_model`), OpenCV (`camera_matrix`, \
         `distortion_coefficients`) or a Kalibr camchain (`cam0`)",
    ))
}
