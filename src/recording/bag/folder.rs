//! The files of a bag: one, or those of the folder that ROS 2 makes of it.
use crate::Error;
use crate::recording::names::natural_order;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// True for a folder with parts of a bag that says so by its `metadata.yaml`, or has nothing else, as one whose recorder was killed.
pub(in crate::recording) fn is_bag(folder: &Path) -> bool {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let (parts, others): (Vec<PathBuf>, Vec<PathBuf>) =
        entries.map(|entry| entry.path()).partition(|path| has_ending(path, "mcap") || has_ending(path, "db3"));
    !parts.is_empty() && (others.is_empty() || folder.join("metadata.yaml").is_file())
}

/// The MCAP files of a bag in natural order, which is that of time: the parts of a recording that was split are numbered.
///
/// Errors: [`Error::Io`], and [`Error::Unusable`] with what makes it one for a bag in SQLite.
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.is_dir() {
        return if has_ending(path, "db3") { Err(in_sqlite(path)) } else { Ok(vec![path.to_owned()]) };
    }
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(|source| Error::io(path, source))? {
        let file = entry.map_err(|source| Error::io(path, source))?.path();
        if has_ending(&file, "mcap") {
            files.push(file);
        }
    }
    files.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    if files.is_empty() { Err(in_sqlite(path)) } else { Ok(files) }
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(OsStr::new(ending)))
}

fn in_sqlite(path: &Path) -> Error {
    let file = path.display();
    Error::Unusable(format!(
        "{file}: is a bag in SQLite (.db3), and those in MCAP are read: `ros2 bag convert -i {file} -o mcap.yaml` makes one, where mcap.yaml \
         is `output_bags: [{{uri: in_mcap, storage_id: mcap, all_topics: true}}]` (in Humble `all: true`)"
    ))
}
