//! What the formats share: the camera matrix, images' sizes, and the names of distortion models.
use super::Intrinsics;
use super::yaml::{Document, Node};
use crate::Error;
use crate::camera::CameraModel;

/// Distortion models by the names that they have in ROS, OpenCV and Kalibr.
const MODELS: &[(&str, CameraModel)] = &[
    ("plumb_bob", CameraModel::BrownConrady),
    ("radtan", CameraModel::BrownConrady),
    ("rational_polynomial", CameraModel::Rational),
    ("equidistant", CameraModel::KannalaBrandt),
    ("fisheye", CameraModel::KannalaBrandt),
    ("none", CameraModel::Pinhole),
];

/// The camera model of a distortion model's name.
pub(crate) fn model_of(name: &str) -> Option<CameraModel> {
    MODELS.iter().find(|(known, _)| *known == name).map(|(_, model)| *model)
}

/// The camera model of a distortion model's name in a file.
pub(super) fn read_model(document: &Document, node: &Node) -> Result<CameraModel, Error> {
    let found = node.text().unwrap_or_default();
    model_of(found).ok_or_else(|| {
        let known = MODELS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        document.error(node, format!("unknown distortion model {} (known: {known})", node.description()))
    })
}

/// Coefficients that a model can take: more may be given where they are 0.
pub(super) fn read_distortion(document: &Document, node: &Node, model: CameraModel) -> Result<Vec<f64>, Error> {
    let node = data(node);
    let mut coefficients = document.numbers(node)?;
    let most = model.distortion().len();
    if let Some(extra) = coefficients.get(most..).and_then(|extra| extra.iter().find(|value| **value != 0.0)) {
        let known = if most == 0 { "none".to_owned() } else { model.distortion().join(" ") };
        let name = model.name();
        let problem =
            format!("found {} coefficients with {extra} among the last, and `{name}` has {known}", coefficients.len());
        return Err(document.error(node, problem));
    }
    coefficients.truncate(most);
    Ok(coefficients)
}

/// [fx, fy] and [cx, cy] of a 3 x 3 camera matrix.
pub(super) fn read_matrix(document: &Document, node: &Node) -> Result<([f64; 2], [f64; 2]), Error> {
    let node = data(node);
    let data = document.numbers(node)?;
    let &[fx, skew, cx, zero, fy, cy, p, q, one] = data.as_slice() else {
        return Err(document.error(node, format!("expected the 9 numbers of a camera matrix, found {}", data.len())));
    };
    if skew != 0.0 || [zero, p, q] != [0.0; 3] || one != 1.0 {
        return Err(document.error(node, "expected a camera matrix [fx, 0, cx, 0, fy, cy, 0, 0, 1], without skew"));
    }
    focal(document, node, [fx, fy])?;
    Ok(([fx, fy], [cx, cy]))
}

/// Refuses focal lengths that are none.
pub(super) fn focal(document: &Document, node: &Node, focal: [f64; 2]) -> Result<(), Error> {
    match focal.iter().find(|focal| **focal <= 0.0) {
        Some(found) => Err(document.error(node, format!("a focal length must be above 0, found {found}"))),
        None => Ok(()),
    }
}

/// The list of numbers that a matrix is: its `data`, where it says its rows and columns too.
pub(super) fn data(node: &Node) -> &Node {
    node.get("data").unwrap_or(node)
}

/// Width and height of the images by any of some keys; `None` where either is not given.
pub(super) fn read_size(document: &Document, root: &Node, keys: [&[&str]; 2]) -> Result<Option<[u32; 2]>, Error> {
    let [width, height] = keys.map(|keys| root.any(keys).map(|node| read_side(document, node)).transpose());
    match (width?, height?) {
        (Some(width), Some(height)) => Ok(Some([width, height])),
        (None, None) => Ok(None),
        _ => Err(document.error(root, format!("has one of `{}` and `{}` and not the other", keys[0][0], keys[1][0]))),
    }
}

/// A side of an image [px].
pub(super) fn read_side(document: &Document, node: &Node) -> Result<u32, Error> {
    let side = node.text().and_then(|text| text.parse().ok()).filter(|side: &u32| *side > 0);
    side.ok_or_else(|| {
        document.error(node, format!("expected a number of pixels above 0, found {}", node.description()))
    })
}

/// Numbers in their shortest form that reads back the same.
pub(super) fn list(numbers: &[f64]) -> String {
    format!("[{}]", numbers.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(", "))
}

impl Intrinsics {
    /// The camera matrix by rows.
    pub(super) fn matrix(&self) -> [f64; 9] {
        let ([fx, fy], [cx, cy]) = (self.focal, self.centre);
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    }

    /// Coefficients, as many as a model has.
    pub(super) fn coefficients(&self, n: usize) -> Vec<f64> {
        let mut coefficients = self.distortion.clone();
        coefficients.resize(n, 0.0);
        coefficients
    }

    /// What messages call it.
    pub(super) fn label(&self) -> String {
        format!("camera `{}`", self.name.as_deref().unwrap_or("camera"))
    }

    pub(super) fn need_size(&self, format: &str) -> Result<[u32; 2], Error> {
        self.size.ok_or_else(|| Error::Unusable(format!("{} has no `size`, which {format} needs", self.label())))
    }
}
