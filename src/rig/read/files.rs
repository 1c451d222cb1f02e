//! Which other files a rig file names.
use super::read_text;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item};

/// The files that a rig file takes values from: its robot's URDF and its cameras' intrinsics; none of a file that cannot be read.
pub fn files_named(rig: &Path) -> Vec<PathBuf> {
    let document = read_text(rig).ok().and_then(|text| text.parse::<DocumentMut>().ok());
    let folder = rig.parent().unwrap_or(Path::new(""));
    document.map_or_else(Vec::new, |document| names(&document).into_iter().map(|name| folder.join(name)).collect())
}

fn names(document: &DocumentMut) -> Vec<&str> {
    let robot = document.get("robot").and_then(|robot| robot.get("urdf"));
    let cameras = document.get("cameras");
    let tables =
        cameras.and_then(Item::as_array_of_tables).into_iter().flatten().map(|camera| camera.get("intrinsics"));
    let values = cameras.and_then(Item::as_array).into_iter().flatten();
    let values = values.filter_map(|camera| camera.as_inline_table()?.get("intrinsics"));
    let in_values = values.map(|value| value.as_str().or_else(|| value.as_inline_table()?.get("file")?.as_str()));
    let in_tables = tables.map(|item| item?.as_str().or_else(|| item?.get("file")?.as_str()));
    [robot.and_then(Item::as_str)].into_iter().chain(in_tables).chain(in_values).flatten().collect()
}
