//! The tables `[[cameras]]`, `[[features]]` and `[[targets]]`: what sees, and what is seen.
use super::document::{Fields, Node};
use super::named::read_named;
use super::pose::read_pose;
use crate::Error;
use crate::camera::CameraModel;
use crate::error::suggestion;
use crate::intrinsics::read_intrinsics;
use crate::rig::names::problem_of_name;
use crate::rig::{Camera, Feature, Joint, Parent, Target};

const CAMERA_KEYS: &[&str] =
    &["name", "size", "model", "fx", "fy", "cx", "cy", "distortion", "intrinsics", "depth", "parent", "pose"];
const FEATURE_KEYS: &[&str] = &["name", "parent", "xyz"];
const TARGET_KEYS: &[&str] = &["name", "parent", "pose"];

/// `taken`: whether intrinsics of other files were taken over already, and are not read again.
pub(super) fn read_cameras(list: Option<Node>, joints: &[Joint], taken: bool) -> Result<Vec<Camera>, Error> {
    let named = read_named(list.as_ref(), "camera", CAMERA_KEYS, problem_of_name)?;
    let read = |(name, fields): (String, Fields)| {
        let camera = read_camera(name, &fields, joints)?;
        match fields.field("intrinsics") {
            Some(intrinsics) if !taken => with_intrinsics(camera, &fields, &intrinsics.value),
            _ => Ok(camera),
        }
    };
    named.into_iter().map(read).collect()
}

fn read_camera(name: String, fields: &Fields, joints: &[Joint]) -> Result<Camera, Error> {
    let model = fields.optional("model", |node| node.word("model", CameraModel::ALL, CameraModel::name))?;
    Ok(Camera {
        name,
        size: fields.optional("size", read_size)?,
        model,
        fx: fields.optional("fx", Node::positive)?,
        fy: fields.optional("fy", Node::positive)?,
        cx: fields.number("cx")?,
        cy: fields.number("cy")?,
        distortion: fields.optional("distortion", |node| read_distortion(node, model))?,
        depth: fields.optional("depth", Node::flag)?.unwrap_or(false),
        parent: fields.optional("parent", |node| read_parent(node, joints))?.unwrap_or(Parent::World),
        pose: fields.optional("pose", read_pose)?,
    })
}

/// A camera of which a calibration file says the intrinsics: `intrinsics = "FILE"`, or `{ file, camera }` of several.
fn with_intrinsics(camera: Camera, fields: &Fields, node: &Node) -> Result<Camera, Error> {
    for key in ["model", "fx", "fy", "cx", "cy", "distortion"] {
        if let Some(field) = fields.field(key) {
            return Err(field.value.error("is what `intrinsics` says: one of the two"));
        }
    }
    let (file, which) = if node.is_table() {
        let fields = node.clone().table(&["file", "camera"])?;
        let file = fields.field("file").ok_or_else(|| fields.error("has no `file`"))?.value;
        (file, fields.optional("camera", |node| node.text().map(str::to_owned))?)
    } else {
        (node.clone(), None)
    };
    let (name, text) = file.text_of_file()?;
    let said = read_intrinsics(&text, &name, which.as_deref())?;
    if let (Some(given), Some(said)) = (camera.size, said.size)
        && given != said
    {
        let problem =
            format!("images are of {}x{} px there, and `size` is {}x{}", said[0], said[1], given[0], given[1]);
        return Err(node.error(problem));
    }
    Ok(Camera {
        size: camera.size.or(said.size),
        model: Some(said.model),
        fx: Some(said.focal[0]),
        fy: Some(said.focal[1]),
        cx: Some(said.centre[0]),
        cy: Some(said.centre[1]),
        distortion: Some(said.distortion),
        ..camera
    })
}

pub(super) fn read_features(list: Option<Node>, joints: &[Joint]) -> Result<Vec<Feature>, Error> {
    let read = |(name, fields): (String, Fields)| -> Result<Feature, Error> {
        Ok(Feature {
            name,
            parent: fields.optional("parent", |node| read_parent(node, joints))?.unwrap_or(Parent::Tip),
            xyz: fields.optional("xyz", Node::numbers::<3>)?,
        })
    };
    read_named(list.as_ref(), "feature", FEATURE_KEYS, problem_of_name)?.into_iter().map(read).collect()
}

pub(super) fn read_targets(list: Option<Node>, joints: &[Joint]) -> Result<Vec<Target>, Error> {
    let read = |(name, fields): (String, Fields)| -> Result<Target, Error> {
        Ok(Target {
            name,
            parent: fields.optional("parent", |node| read_parent(node, joints))?.unwrap_or(Parent::World),
            pose: fields.optional("pose", read_pose)?,
        })
    };
    read_named(list.as_ref(), "target", TARGET_KEYS, problem_of_name)?.into_iter().map(read).collect()
}

fn read_size(node: &Node) -> Result<[u32; 2], Error> {
    let list = node.list()?;
    let [width, height] = list.as_slice() else {
        return Err(node.error(format!("expected width and height, found {} numbers", list.len())));
    };
    for side in [width, height] {
        if side.whole::<i64>()? <= 0 {
            return Err(node.error(format!("width and height must be above 0, found {}", side.whole::<i64>()?)));
        }
    }
    Ok([width.whole()?, height.whole()?])
}

fn read_distortion(node: &Node, model: Option<CameraModel>) -> Result<Vec<f64>, Error> {
    let numbers = node.any_numbers()?;
    match problem_of_distortion(model, numbers.len()) {
        Some(problem) => Err(node.error(problem)),
        None => Ok(numbers),
    }
}

/// Why there are too many coefficients. Where no model is named, the recording's header may name one.
pub(crate) fn problem_of_distortion(model: Option<CameraModel>, found: usize) -> Option<String> {
    let most = CameraModel::ALL.iter().map(|model| model.distortion().len()).max().unwrap_or(0);
    match model {
        None if found > most => Some(format!("found {found} coefficients, and no model has more than {most}")),
        Some(model) if found > model.distortion().len() => Some(match model.distortion() {
            [] => format!("found {found} coefficients, and the model `{}` has none", model.name()),
            known => format!(
                "found {found} coefficients, and the model `{}` has {} ({})",
                model.name(),
                known.len(),
                known.join(" ")
            ),
        }),
        _ => None,
    }
}

fn read_parent(node: &Node, joints: &[Joint]) -> Result<Parent, Error> {
    match node.text()? {
        "world" => Ok(Parent::World),
        "tip" => Ok(Parent::Tip),
        name => {
            // A joint's name goes before a link's: it is what is written.
            let joint = joints.iter().position(|joint| joint.name == name);
            let link = || joints.iter().position(|joint| joint.link.as_deref() == Some(name));
            joint.or_else(link).map(Parent::Link).ok_or_else(|| {
                let links = joints.iter().filter_map(|joint| joint.link.as_deref());
                let names = joints.iter().map(|joint| joint.name.as_str()).chain(links);
                node.error(format!(
                    "no joint is called `{name}` {}",
                    suggestion(name, ["world", "tip"].into_iter().chain(names))
                ))
            })
        }
    }
}
