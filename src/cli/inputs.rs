//! Reading a rig and the recordings that go with it, and seeing in time that an output can be written.
use super::answer::remark;
use super::reading::Reading;
use super::words::count;
use crate::error::shipped;
use crate::recording::is_in_another_order;
use handeye::Error;
use handeye::calibrate::put_on_tip;
use handeye::recording::{Format, OpenOptions, Opened, RecordedCamera, Recording, Sample};
use handeye::rig::{Rig, catalog, files_named, matches, replace_file};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// How far into a file the mark of a recording is looked for [bytes].
const HEADER: u64 = 1 << 12;

/// A rig that was named on the command line.
pub struct RigInput {
    pub rig: Rig,
    /// The text of its file, whose comments are kept.
    pub text: String,
    /// What messages call it.
    pub name: String,
}

/// Reads a rig file, or takes the shipped rig of that name where there is no such file.
pub fn read_rig(argument: &Path) -> Result<RigInput, Error> {
    let name = argument.display().to_string();
    if !argument.exists()
        && let Some((_, text)) = catalog::ALL.iter().find(|(known, _)| *known == name)
    {
        return Ok(RigInput { rig: catalog::rig(&name)?, text: (*text).to_owned(), name });
    }
    if argument.try_exists().is_ok_and(|exists| !exists) {
        return Err(unknown(argument, "rig", catalog::ALL));
    }
    if is_recording(argument) {
        return Err(Error::Unusable(format!(
            "{name}: that is a recording, and a rig is expected here: handeye calibrate RECORDING --rig RIG, but handeye check RIG RECORDING \
             (evaluate, infer and monitor likewise)"
        )));
    }
    let (rig, text) = Rig::read_with_text(argument)?;
    Ok(RigInput { rig, text, name })
}

/// True where the file's ending or its first line says so.
fn is_recording(path: &Path) -> bool {
    if path.is_file() && Format::of(path) == Format::JsonLines {
        let mut start = Vec::new();
        // What cannot be read is told by whoever reads it.
        let _ = File::open(path).and_then(|file| file.take(HEADER).read_to_end(&mut start));
        let header = String::from_utf8_lossy(&start);
        return header.trim_start().starts_with('{') && header.contains("\"handeye-recording\"");
    }
    match Format::of(path) {
        Format::JsonLines => false,
        Format::LeRobot => path.join("meta").is_dir(),
        Format::Bag | Format::Csv | Format::Parquet => true,
    }
}

/// What is neither a file nor the name of something that is shipped.
pub fn unknown(argument: &Path, what: &str, known: &[(&str, &str)]) -> Error {
    let meant = argument.file_stem().unwrap_or_default().to_string_lossy();
    let known = shipped(&meant, known.iter().map(|(name, _)| *name));
    Error::Unusable(format!("{}: neither a {what} file nor a shipped {what} {known}", argument.display()))
}

/// Reads recordings as one, and refuses what the rig cannot be the rig of.
pub fn read_recordings(paths: &[PathBuf], rig: Option<&RigInput>, reading: &Reading) -> Result<Recording, Error> {
    Ok(read_and_remark(paths, rig, reading, &[])?.0)
}

/// The same with what has to be said of how they were read, which is told on standard error.
///
/// Parameters that match any of `new` may be of cameras that the rig does not have yet.
pub fn read_and_remark(
    paths: &[PathBuf],
    rig: Option<&RigInput>,
    reading: &Reading,
    new: &[String],
) -> Result<(Recording, Vec<String>), Error> {
    let (recording, notes) = read_with_notes(paths, rig, reading, new)?;
    notes.iter().for_each(|note| remark(note));
    Ok((recording, notes))
}

/// The same where nothing is told.
pub fn read_with_notes(
    paths: &[PathBuf],
    rig: Option<&RigInput>,
    reading: &Reading,
    new: &[String],
) -> Result<(Recording, Vec<String>), Error> {
    let files: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let known_joints = rig.map_or_else(Vec::new, |input| input.rig.robot.joint_names());
    let options = OpenOptions { known_joints, ..reading.options(&files)? };
    let is_rig = |path: &&PathBuf| path.extension().is_some_and(|extension| extension == "toml") && path.is_file();
    if let Some(path) = paths.iter().find(is_rig) {
        let problem = format!("{}: that is a rig file, and a recording is expected here", path.display());
        return Err(Error::Unusable(problem));
    }
    let Opened { recording, notes, .. } = Recording::open_all(paths, &options)?;
    if let Some(problem) = rig.and_then(|rig| mismatch(rig, &recording, new)) {
        let file = paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        return Err(Error::Malformed { file, line: 1, column: 1, problem });
    }
    Ok((recording, notes))
}

/// Puts the cameras that only the recording has on the hand.
pub fn eye_in_hand(rig: &mut Rig, recording: &Recording) -> Result<(), Error> {
    if put_on_tip(rig, recording) {
        return Ok(());
    }
    Err(Error::Unusable("the rig lists every camera with its parent, where --eye-in-hand has no effect".to_owned()))
}

/// Why a recording is not one of this rig.
fn mismatch(input: &RigInput, recording: &Recording, new: &[String]) -> Option<String> {
    let RigInput { rig, name, .. } = input;
    let (ours, theirs) = (rig.robot.joints.len(), recording.joints.len());
    if ours != theirs && ours > 0 {
        let joints = recording.joints.join(", ");
        let named = if joints.is_empty() { joints } else { format!("; those of the recording: {joints}") };
        let has = |joint: &String| recording.joints.iter().any(|other| other.contains(joint));
        let is_other = theirs > 0 && !rig.robot.joint_names().iter().any(has);
        let names = if is_other { ", under other names: is it of this robot?" } else { "" };
        return Some(format!("the recording has {}, the rig {name} has {ours}{names}{named}", count(theirs, "joint")));
    }
    let names = rig.robot.joint_names();
    if is_in_another_order(&recording.joints, &names) {
        let (theirs, ours) = (recording.joints.join(", "), names.join(", "));
        return Some(format!("the joints are in the order {theirs}, those of the rig {name} in the order {ours}"));
    }
    let is_used = |index: usize| {
        let index = index as u32;
        let is_used = |sample: &Sample| {
            sample.pixels.iter().any(|seen| seen.camera == index)
                || sample.points.iter().any(|seen| seen.camera == index)
        };
        recording.samples.iter().any(is_used)
    };
    let is_new = |name: &str| new.iter().any(|pattern| matches(pattern, &format!("cameras.{name}.pose")));
    let is_known =
        |name: &str| rig.cameras.is_empty() || rig.cameras.iter().any(|camera| camera.name == name) || is_new(name);
    let (_, unknown) =
        recording.cameras.iter().enumerate().find(|(index, camera)| !is_known(&camera.name) && is_used(*index))?;
    let known = rig.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
    let name_of_it = &unknown.name;
    let would_do =
        if new.is_empty() { String::new() } else { format!("; --relearn cameras.{name_of_it} would add it") };
    Some(format!("camera `{name_of_it}` is not in the rig {name} (known: {known}){would_do}"))
}

/// What is known of a camera, `left=640x480` or `left=left.yaml`.
pub fn read_camera(text: &str) -> Result<RecordedCamera, Error> {
    let Some((name, value)) = text.split_once('=') else {
        return Err(Error::Unusable(format!("--camera {text}: expected NAME=WIDTHxHEIGHT or NAME=FILE")));
    };
    let side = |side: &str| side.parse::<u32>().ok().filter(|side| *side > 0);
    if let Some(size) = value.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?])) {
        return Ok(RecordedCamera { name: name.to_owned(), size: Some(size), ..RecordedCamera::default() });
    }
    RecordedCamera::read(name, Path::new(value))
}

/// True where two paths name one file, which need not exist yet.
pub fn is_same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    };
    one == other || place(one).is_some_and(|one| Some(one) == place(other))
}

/// Every file that is read: recordings, those that a rig names, and the lenses of cameras.
pub fn files_read(recordings: &[PathBuf], rig: Option<&Path>, reading: &Reading) -> Vec<PathBuf> {
    let of_rig = rig.map_or_else(Vec::new, files_named);
    recordings.iter().cloned().chain(of_rig).chain(reading.lens_files()).collect()
}

/// Fails where an output could not be written, or would replace one of the inputs: before the work, not after it.
pub fn check_output(path: &Path, inputs: &[PathBuf]) -> Result<(), Error> {
    if path.is_dir() {
        return Err(Error::Io { path: path.to_owned(), source: io::ErrorKind::IsADirectory.into() });
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        let problem = format!("{}: there is no folder `{}`", path.display(), folder.display());
        return Err(Error::Unusable(problem));
    }
    let Ok(output) = path.canonicalize() else { return Ok(()) };
    match inputs.iter().find(|input| input.canonicalize().is_ok_and(|input| input == output)) {
        None => Ok(()),
        Some(_) => {
            Err(Error::Unusable(format!("{}: this would be written over, and it is an input too", path.display())))
        }
    }
}

/// Writes a text to a file, of which whoever reads sees the old one or the new.
pub fn write_output(path: &Path, text: &str) -> Result<(), Error> {
    replace_file(path, |file| file.write_all(text.as_bytes()))
}
