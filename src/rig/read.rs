//! Reading rig files: every mistake is reported with its line and column, what was found, and what would do.
pub(crate) mod document;
mod estimate;
mod files;
mod fit;
pub(crate) mod named;
pub(crate) mod noise;
mod pose;
mod robot;
mod urdf;
mod views;

use super::Rig;
use crate::Error;
use document::{Node, Source};
pub(crate) use estimate::problem_of_fixed;
pub use files::files_named;
use std::path::Path;
pub(crate) use views::problem_of_distortion;

impl Rig {
    /// Reads a rig file.
    ///
    /// Errors: [`Error::Io`], and [`Error::Malformed`] for whatever is wrong inside.
    pub fn read(path: &Path) -> Result<Rig, Error> {
        Rig::parse(&read_text(path)?, &path.display().to_string())
    }

    /// Reads the text of a rig file, which messages call `file_name`. Other files that it names are looked for beside that.
    pub fn parse(text: &str, file_name: &str) -> Result<Rig, Error> {
        parse(text, file_name, None)
    }
}

/// `taken`: a rig that has taken over already what other files say, which are not read again.
pub(super) fn parse(text: &str, file_name: &str, taken: Option<&Rig>) -> Result<Rig, Error> {
    let source = Source { file: file_name, text };
    let document = document::parse(&source)?;
    let root = Node::root(&source, document.as_table());
    let fields = root.table(&["name", "robot", "cameras", "features", "targets", "noise", "estimate", "fit"])?;
    let node = |key: &str| fields.field(key).map(|field| field.value);
    let mut rig = Rig { name: fields.optional("name", |node| node.text().map(str::to_owned))?, ..Rig::default() };
    if let Some(node) = node("robot") {
        rig.robot = robot::read_robot(node, taken.map(|rig| &rig.robot))?;
    }
    rig.cameras = views::read_cameras(node("cameras"), &rig.robot.joints, taken.is_some())?;
    rig.features = views::read_features(node("features"), &rig.robot.joints)?;
    rig.targets = views::read_targets(node("targets"), &rig.robot.joints)?;
    if let Some(node) = node("noise") {
        rig.noise = noise::read_noise(&node)?;
    }
    if let Some(node) = node("estimate") {
        rig.estimate = estimate::read_estimate(&node, &rig)?;
    }
    if let Some(node) = node("fit") {
        rig.fit = Some(fit::read_fit(&node, &rig)?);
    }
    Ok(rig)
}

/// The text of a file, which has to be UTF-8.
pub fn read_text(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::io(path, source))?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let text = String::from_utf8_lossy(&error.as_bytes()[..valid]);
        Error::at(&path.display().to_string(), &text, valid, "this is not UTF-8 text".to_owned())
    })
}
