//! Kalibr's camchain: `cam0`, `cam1` ..., each with the pose of the one before.
use super::Intrinsics;
use super::parts::{focal, list, read_distortion, read_model, read_side};
use super::yaml::{Document, Node};
use crate::Error;
use crate::camera::CameraModel;
use handeye_solvers::Pose;
use std::fmt::Write;

pub(super) fn is_camchain(root: &Node) -> bool {
    root.entries().iter().any(|(_, node)| node.get("camera_model").is_some() && node.get("intrinsics").is_some())
}

pub(super) fn read(document: &Document, camera: Option<&str>) -> Result<Intrinsics, Error> {
    let cameras: Vec<_> =
        document.root.entries().iter().filter(|(_, node)| node.get("camera_model").is_some()).collect();
    let names = || cameras.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    let (name, node) = match (camera, cameras.as_slice()) {
        (Some(camera), _) => cameras.iter().find(|(name, _)| name == camera).ok_or_else(|| {
            document.error(&document.root, format!("no camera is called `{camera}` (known: {})", names()))
        })?,
        (None, [one]) => one,
        (None, _) => {
            let problem = format!(
                "there are several cameras, name one: {{ file = \"...\", camera = \"...\" }} with one of {}",
                names()
            );
            return Err(document.error(&document.root, problem));
        }
    };
    let kind = document.need(node, "camera_model")?;
    if kind.text() != Some("pinhole") {
        let problem = format!("unknown camera model {} (known: pinhole)", kind.description());
        return Err(document.error(kind, problem));
    }
    let intrinsics = document.need(node, "intrinsics")?;
    let &[fx, fy, cx, cy] = document.numbers(intrinsics)?.as_slice() else {
        return Err(document.error(intrinsics, "expected the 4 numbers fu, fv, pu, pv"));
    };
    focal(document, intrinsics, [fx, fy])?;
    let model = node.get("distortion_model").map_or(Ok(CameraModel::Pinhole), |node| read_model(document, node))?;
    let distortion = node.get("distortion_coeffs").map(|node| read_distortion(document, node, model)).transpose()?;
    let size = match node.get("resolution") {
        None => None,
        Some(resolution) => match resolution.items() {
            [width, height] => Some([read_side(document, width)?, read_side(document, height)?]),
            _ => return Err(document.error(resolution, "expected width and height")),
        },
    };
    Ok(Intrinsics {
        name: Some(name.clone()),
        size,
        model,
        focal: [fx, fy],
        centre: [cx, cy],
        distortion: distortion.unwrap_or_default(),
    })
}

/// A camchain. With each camera stands its pose in space, where it has one; cameras that follow one another then say how the
/// earlier is seen from the later.
///
/// Errors: [`Error::Unusable`] for what Kalibr has no words for: a camera without a size, a rational lens, a third radial
/// coefficient.
pub fn to_kalibr(cameras: &[(Intrinsics, Option<Pose>)]) -> Result<String, Error> {
    let mut text = String::new();
    let mut before: Option<Pose> = None;
    for (index, (camera, pose)) in cameras.iter().enumerate() {
        let [width, height] = camera.need_size("a camchain")?;
        let (model, n) = match camera.model {
            CameraModel::Pinhole => ("none", 0),
            CameraModel::BrownConrady if camera.distortion.get(4).is_none_or(|k3| *k3 == 0.0) => ("radtan", 4),
            CameraModel::BrownConrady => return Err(without_words(camera, "a third radial coefficient")),
            CameraModel::KannalaBrandt => ("equidistant", 4),
            CameraModel::Rational => return Err(without_words(camera, "a rational lens")),
        };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "cam{index}: # {}", camera.name.as_deref().unwrap_or("camera"));
        let camera_from_before = pose.zip(before).map(|(pose, before)| pose.inverse() * before);
        if let Some(Pose { rotation: r, translation: t }) = camera_from_before {
            text += "  T_cn_cnm1:\n";
            for i in 0..3 {
                let _ = writeln!(text, "  - {}", list(&[r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]]));
            }
            text += "  - [0.0, 0.0, 0.0, 1.0]\n";
        }
        let numbers = list(&[camera.focal[0], camera.focal[1], camera.centre[0], camera.centre[1]]);
        let _ = write!(
            text,
            "  camera_model: pinhole\n  intrinsics: {numbers}\n  distortion_model: {model}\n  distortion_coeffs: {}\n  \
             resolution: [{width}, {height}]\n",
            list(&camera.coefficients(n))
        );
        before = *pose;
    }
    Ok(text)
}

fn without_words(camera: &Intrinsics, what: &str) -> Error {
    Error::Unusable(format!(
        "{} has {what}, which a camchain cannot say: camera_info or opencv would do",
        camera.label()
    ))
}
