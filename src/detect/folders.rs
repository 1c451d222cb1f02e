//! Folders of images, one per camera.
use super::names::Names;
use super::{Gray, Pattern};
use crate::Error;
use crate::recording::{Found, ImageSeen, RecordedCamera, natural_order, px};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Endings of the images that are read.
const ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// The images of one camera.
#[derive(Clone, Debug)]
pub struct Folder {
    /// The camera's name.
    pub camera: String,
    /// The images.
    pub files: Vec<PathBuf>,
}

impl Folder {
    /// The images of a folder, of a camera called `camera` or as the folder is; or those of every folder in it, where it has no images
    /// itself.
    ///
    /// Errors: [`Error::Io`], and [`Error::Unusable`] where there is no image.
    pub fn open(path: &Path, camera: Option<&str>) -> Result<Vec<Folder>, Error> {
        let whole = path.canonicalize().map_err(|source| Error::io(path, source))?;
        let name = |path: &Path| path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let (files, folders) = list(path)?;
        if !files.is_empty() {
            return Ok(vec![Folder { camera: camera.map_or_else(|| name(&whole), str::to_owned), files }]);
        }
        let mut found = Vec::new();
        for folder in folders.iter().filter(|_| camera.is_none()) {
            let (files, _) = list(folder)?;
            if !files.is_empty() {
                found.push(Folder { camera: name(folder), files });
            }
        }
        if found.is_empty() {
            return Err(Error::Unusable(format!("{}: has no images (PNG or JPEG)", path.display())));
        }
        Ok(found)
    }
}

/// Images and folders in a folder, in natural order.
fn list(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Error> {
    let (mut files, mut folders) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(folder).map_err(|source| Error::io(folder, source))? {
        let path = entry.map_err(|source| Error::io(folder, source))?.path();
        let ending = path.extension().map_or_else(String::new, |ending| ending.to_string_lossy().to_lowercase());
        if path.is_dir() {
            folders.push(path);
        } else if ENDINGS.contains(&ending.as_str()) {
            files.push(path);
        }
    }
    for list in [&mut files, &mut folders] {
        list.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    }
    Ok((files, folders))
}

/// What all images show, in the order of their names (of numbers where all are, 99 before 100) and then of cameras; and the cameras, with the
/// sizes of their images.
///
/// Images are looked at on all cores of the current pool; the result does not depend on how many there are.
///
/// Errors: [`Error::Io`], and [`Error::Unusable`] with the file that cannot be decoded, that is of another size than the camera's first, or
/// whose name another has too.
pub fn detect_in_folders(
    folders: &[Folder],
    patterns: &[Pattern],
) -> Result<(Vec<RecordedCamera>, Vec<ImageSeen>), Error> {
    let mut cameras: Vec<RecordedCamera> = Vec::new();
    for folder in folders {
        if cameras.iter().any(|camera| camera.name == folder.camera) {
            return Err(Error::Unusable(format!("two folders are of camera `{}`", folder.camera)));
        }
        refuse_same_names(folder)?;
        cameras.push(RecordedCamera { name: folder.camera.clone(), ..RecordedCamera::default() });
    }
    let stems: Vec<Vec<String>> =
        folders.iter().map(|folder| folder.files.iter().map(|file| stem(file)).collect()).collect();
    let names = Names::new(stems.iter().flatten().map(String::as_str));
    let mut seen: Vec<ImageSeen> = Vec::new();
    for (index, (folder, stems)) in folders.iter().zip(&stems).enumerate() {
        let look = |file: &PathBuf| {
            let bytes = std::fs::read(file).map_err(|source| Error::io(file, source))?;
            let image =
                Gray::decode(&bytes).map_err(|problem| Error::Unusable(format!("{}: {problem}", file.display())))?;
            let features = patterns.iter().flat_map(|pattern| pattern.detect(&image)).collect();
            Ok(Found { size: image.size(), features })
        };
        let looked: Vec<Result<Found, Error>> = folder.files.par_iter().map(look).collect();
        for ((file, name), looked) in folder.files.iter().zip(stems).zip(looked) {
            let Found { size, features } = looked?;
            let camera = &mut cameras[index];
            let known = *camera.size.get_or_insert(size);
            if known != size {
                return Err(Error::Unusable(format!(
                    "{}: is of {}, and others of camera `{}` are of {}",
                    file.display(),
                    px(size),
                    camera.name,
                    px(known)
                )));
            }
            seen.push(ImageSeen { camera: index as u32, name: name.clone(), time: names.time(name), features });
        }
    }
    seen.sort_by(|a, b| names.order(&a.name, &b.name).then(a.camera.cmp(&b.camera)));
    Ok((cameras, seen))
}

/// The name of a file without folder and ending.
fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

fn refuse_same_names(folder: &Folder) -> Result<(), Error> {
    let mut met: BTreeMap<String, &Path> = BTreeMap::new();
    for file in &folder.files {
        let name = stem(file);
        if let Some(before) = met.get(&name) {
            let (before, file, camera) = (before.display(), file.display(), &folder.camera);
            return Err(Error::Unusable(format!(
                "{before} and {file}: camera `{camera}` has two images called `{name}`"
            )));
        }
        met.insert(name, file);
    }
    Ok(())
}
