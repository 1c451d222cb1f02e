//! Folders of images, one per camera.
use super::{Gray, Pattern};
use crate::Error;
use crate::recording::{ImageSeen, RecordedCamera, natural_order};
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
    /// The images, by their names in natural order.
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

/// What all images show, by name and then by camera; and the cameras, with the sizes of their images.
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
    let mut images: BTreeMap<usize, Vec<(PathBuf, ImageSeen, [u32; 2])>> = BTreeMap::new();
    for (index, folder) in folders.iter().enumerate() {
        if cameras.iter().any(|camera| camera.name == folder.camera) {
            return Err(Error::Unusable(format!("two folders are of camera `{}`", folder.camera)));
        }
        cameras.push(RecordedCamera { name: folder.camera.clone(), ..RecordedCamera::default() });
        let looked = folder.files.par_iter().map(|file| {
            let bytes = std::fs::read(file).map_err(|source| Error::io(file, source))?;
            let image =
                Gray::decode(&bytes).map_err(|problem| Error::Unusable(format!("{}: {problem}", file.display())))?;
            let features = patterns.iter().flat_map(|pattern| pattern.detect(&image)).collect();
            let name = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            let time = time_of(&name);
            Ok((
                file.clone(),
                ImageSeen { camera: index as u32, name, time, features },
                [image.width as u32, image.height as u32],
            ))
        });
        images.insert(index, looked.collect::<Vec<Result<_, Error>>>().into_iter().collect::<Result<_, _>>()?);
    }
    let mut seen: Vec<ImageSeen> = Vec::new();
    for (index, images) in images {
        for pair in images.windows(2) {
            let [(_, before, _), (file, after, _)] = pair else { continue };
            if before.name == after.name {
                return Err(Error::Unusable(format!(
                    "{}: another image is called `{}` too",
                    file.display(),
                    after.name
                )));
            }
        }
        for (file, image, size) in images {
            let known = *cameras[index].size.get_or_insert(size);
            if known != size {
                let [width, height] = size;
                return Err(Error::Unusable(format!(
                    "{}: is of {width} x {height} pixels, and others of camera `{}` are of {} x {}",
                    file.display(),
                    cameras[index].name,
                    known[0],
                    known[1]
                )));
            }
            seen.push(image);
        }
    }
    seen.sort_by(|a, b| natural_order(&a.name, &b.name).then(a.camera.cmp(&b.camera)));
    Ok((cameras, seen))
}

/// The time that a name is [s]: `1700000000.25`, or a count of s, ms, µs or ns since 1970, which their number of digits tells apart.
fn time_of(name: &str) -> Option<f64> {
    let is_number = !name.is_empty() && name.chars().all(|c| c.is_ascii_digit() || c == '.');
    let number: f64 = name.parse().ok().filter(|_| is_number)?;
    Some(match name.len() {
        _ if name.contains('.') => number,
        12..=13 => number / 1e3,
        15..=16 => number / 1e6,
        18..=19 => number / 1e9,
        _ => number,
    })
}
