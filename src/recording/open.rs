//! A recording in whatever format its file's ending names.
use super::{BagOptions, RecordedCamera, Recording, TableOptions, bag, table};
use crate::Error;
use std::path::{Path, PathBuf};

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// What has no other ending.
    JsonLines,
    /// `.mcap`, or the folder that ROS 2 makes of a bag; `.db3` too, which is refused with what makes the other of it.
    Bag,
    /// `.csv`, `.tsv`
    Csv,
    /// `.parquet`
    Parquet,
    /// Any other folder.
    LeRobot,
}

impl Format {
    /// The format of a file, by the ending of its name, whatever its case; of a folder, by what is in it.
    pub fn of(path: &Path) -> Format {
        let ending = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            _ if path.is_dir() => {
                if bag::is_bag(path) {
                    Format::Bag
                } else {
                    Format::LeRobot
                }
            }
            Some("mcap" | "db3") => Format::Bag,
            Some("csv" | "tsv") => Format::Csv,
            Some("parquet") => Format::Parquet,
            _ => Format::JsonLines,
        }
    }
}

/// What of a file is meant, where it alone does not tell. Options of one format are nothing to the others, see [`OpenOptions::without_effect`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// Names of the joints from base to tip, some of those in the file; empty: `known_joints`, or all in the order of the file's header or of
    /// the first joint state that has most.
    pub joints: Vec<String>,
    /// Names that the joints have where the file has all of them, as those of a rig: others are left out, as those of a gripper.
    pub known_joints: Vec<String>,
    /// What is known of cameras, by name: a lens replaces what the file says of it, a size has to be that of the images, or of the CameraInfo.
    pub cameras: Vec<RecordedCamera>,
    /// What is added to the stamps of the robot's readings before they are interpolated to the times of samples [s]; negative where they are stamped
    /// too late. Of a bag these are joint states, tip poses and TF; of other files the joints and poses of the samples, which have to be dense.
    pub joint_delay: Option<f64>,
    /// One sample of each standstill in place of all, see [`Recording::still`].
    pub still: bool,
    /// Of bags.
    pub bag: BagOptions,
    /// Of tables.
    pub table: TableOptions,
}

/// A recording, and what has to be said of how it was read.
#[derive(Clone, Debug)]
pub struct Opened {
    /// The recording.
    pub recording: Recording,
    /// What was left out, taken for granted, interpolated or put into the order of known joints, that there are pauses, and where the file ends
    /// early: one line each.
    pub notes: Vec<String>,
    /// For each sample the name of the image that it goes with, without folder and ending, where a CSV file has a column `image`; otherwise empty.
    pub images: Vec<String>,
}

impl Recording {
    /// Reads a recording in any [`Format`].
    ///
    /// Errors: those of [`Recording::read`]; [`Error::Malformed`] with line and column of a CSV file; [`Error::Unusable`] with row and column of
    /// a Parquet file, with topic and message of a bag, and for options that name what the file does not have, standstills too.
    pub fn open_with(path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
        let opened = open(path, options)?;
        opened.with_cameras(&path.display().to_string(), options)
    }

    /// Reads several recordings as [`Recording::open_with`] does and joins them as [`Recording::read_all`] does. The joints of the first are those
    /// that are known in the others, which may have them in another order and beside more. What the options say of a camera is said of it in every
    /// file that has it, and each note begins with its file.
    ///
    /// Errors: those of both.
    pub fn open_all(paths: &[PathBuf], options: &OpenOptions) -> Result<Opened, Error> {
        let mut all_notes = Vec::new();
        let (mut of_file, mut first_has) = (options.clone(), false);
        let recording = Recording::read_all_with(paths, &mut |path| {
            let Opened { recording, notes, .. } = open(path, &of_file)?;
            if !recording.joints.is_empty() && !first_has {
                first_has = true;
                of_file.known_joints.clone_from(&recording.joints);
            }
            all_notes.extend(notes.iter().map(|note| format!("{}: {note}", path.display())));
            Ok(recording)
        })?;
        let files = paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        Opened { recording, notes: all_notes, images: Vec::new() }.with_cameras(&files, options)
    }
}

impl Opened {
    /// Errors: [`Error::Unusable`] where the options say something of a camera that is not there.
    pub(super) fn with_cameras(self, files: &str, options: &OpenOptions) -> Result<Opened, Error> {
        let problem = self.recording.need_cameras(&options.cameras).err();
        problem.map_or(Ok(self), |problem| Err(Error::Unusable(format!("{files}: {problem}"))))
    }
}

/// The same where cameras of which the options say something may be missing.
fn open(path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
    let opened = open_whole(path, options)?;
    // A bag's are stamped before they are interpolated to the times of images.
    let opened = if Format::of(path) == Format::Bag { opened } else { opened.delayed(path, options)? };
    opened.still(path, options)
}

/// The same with all samples.
fn open_whole(path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
    match Format::of(path) {
        Format::JsonLines => {
            let mut recording = Recording::read(path)?;
            let described = recording.describe_those_there(&options.cameras);
            let unusable = |problem: String| Error::Unusable(format!("{}: {problem}", path.display()));
            described.map_err(unusable)?;
            let notes = recording.take_joints(options).map_err(unusable)?;
            Ok(Opened { recording, notes, images: Vec::new() })
        }
        Format::Bag => bag::read(path, options, None),
        Format::Csv => table::read_csv(path, options),
        Format::Parquet => table::read_parquet(path, options),
        Format::LeRobot => table::read_lerobot(path, options),
    }
}
