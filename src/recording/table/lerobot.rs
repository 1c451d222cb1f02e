//! What a LeRobot dataset says beside its numbers: names of joints, sizes of images.
use crate::Error;
use crate::recording::RecordedCamera;
use crate::recording::names::{joint_name, natural_order, tidy};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What `meta/info.json` says; nothing where there is none.
#[derive(Debug, Default)]
pub(super) struct Info {
    /// Names of the numbers of `observation.state`, as parameter paths can hold them.
    pub state: Vec<String>,
    /// Names of the numbers of `action`.
    pub action: Vec<String>,
    /// Cameras with their image sizes.
    pub cameras: Vec<RecordedCamera>,
}

/// Folders above a data file in which `meta/info.json` may be: `data/chunk-000/file-000.parquet` stands two below.
const HIGHEST: usize = 4;

impl Info {
    /// The information that goes with a data file.
    ///
    /// Errors: [`Error::Malformed`] where it is no JSON.
    pub(super) fn find(data: &Path) -> Result<Info, Error> {
        let whole = std::path::absolute(data).unwrap_or_else(|_| data.to_owned());
        let found = whole.ancestors().skip(1).take(HIGHEST).map(|folder| folder.join("meta/info.json"));
        let Some(path) = found.into_iter().find(|path| path.is_file()) else { return Ok(Info::default()) };
        let text = std::fs::read_to_string(&path).map_err(|source| Error::io(&path, source))?;
        let value: Value = serde_json::from_str(&text).map_err(|error| Error::Malformed {
            file: path.display().to_string(),
            line: error.line().max(1),
            column: error.column().max(1),
            problem: format!("this is no JSON: {error}"),
        })?;
        let features = &value["features"];
        let mut cameras = Vec::new();
        for (key, feature) in features.as_object().into_iter().flatten() {
            let is_image = matches!(feature["dtype"].as_str(), Some("video" | "image"));
            if let Some(name) = key.strip_prefix("observation.images.").filter(|_| is_image) {
                let size = size(feature);
                cameras.push(RecordedCamera { name: tidy(name), size, ..RecordedCamera::default() });
            }
        }
        let list = |key: &str| names(&features[key]["names"]);
        Ok(Info { state: list("observation.state"), action: list("action"), cameras })
    }
}

/// Names in a list, or in lists by any keys, as older datasets have them: `{"motors": ["main_shoulder_pan", ...]}`.
fn names(value: &Value) -> Vec<String> {
    match value {
        Value::String(name) => vec![joint_name(name)],
        Value::Array(list) => list.iter().flat_map(names).collect(),
        Value::Object(lists) => lists.values().flat_map(names).collect(),
        _ => Vec::new(),
    }
}

/// Width and height, by the names of the axes or as height, width, channels.
fn size(feature: &Value) -> Option<[u32; 2]> {
    let axes = names(&feature["names"]);
    let side = |axis: &str, usual: usize| {
        let index = axes.iter().position(|name| name == axis).unwrap_or(usual);
        feature["shape"][index].as_u64().and_then(|side| u32::try_from(side).ok()).filter(|side| *side > 0)
    };
    Some([side("width", 1)?, side("height", 0)?])
}

/// The data files of a dataset, in the order of their names.
///
/// Errors: [`Error::Io`], [`Error::Unusable`] where the folder is no dataset.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    let data = folder.join("data");
    if data.is_dir() && folder.join("meta/info.json").is_file() {
        collect(&data, &mut files)?;
    }
    if files.is_empty() {
        return Err(Error::Unusable(format!(
            "{}: is a folder, and neither a LeRobot dataset, which has `meta/info.json` and Parquet files in `data`, nor a bag, which has \
             `metadata.yaml` and .mcap files",
            folder.display()
        )));
    }
    files.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(files)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Error> {
    for entry in std::fs::read_dir(folder).map_err(|source| Error::io(folder, source))? {
        let path = entry.map_err(|source| Error::io(folder, source))?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "parquet") {
            files.push(path);
        }
    }
    Ok(())
}
