//! A recording in whatever format its file's ending names.
use super::{Bag, BagOptions, Recording, Table, TableOptions};
use crate::Error;
use std::path::Path;

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// What has no other ending.
    JsonLines,
    /// `.mcap`
    Bag,
    /// `.csv`, `.tsv`
    Csv,
    /// `.parquet`
    Parquet,
    /// A folder.
    LeRobot,
}

impl Format {
    /// The format of a file, by the ending of its name, whatever its case.
    pub fn of(path: &Path) -> Format {
        let ending = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("mcap") => Format::Bag,
            Some("csv" | "tsv") => Format::Csv,
            Some("parquet") => Format::Parquet,
            _ if path.is_dir() => Format::LeRobot,
            _ => Format::JsonLines,
        }
    }
}

/// A recording, and what has to be said of how it was read.
#[derive(Clone, Debug)]
pub struct Opened {
    /// The recording.
    pub recording: Recording,
    /// What was left out or taken for granted: one line each. Nothing where it was written by handeye.
    pub notes: Vec<String>,
    /// For each sample the name of the image that it goes with, where the file has such names (see [`Table`]); otherwise empty.
    pub images: Vec<String>,
}

impl Recording {
    /// Reads a recording in any [`Format`] with default options.
    ///
    /// `joints`: names of the joints from base to tip, as those of a rig, in whose order they are read from a file that has all of them;
    /// nothing to JSON Lines, which are in the right order.
    ///
    /// Errors: those of [`Recording::read`], [`Bag::read`] and [`Table`].
    pub fn open(path: &Path, joints: &[String]) -> Result<Opened, Error> {
        let known_joints = joints.to_vec();
        let bag = || BagOptions { known_joints: known_joints.clone(), ..BagOptions::default() };
        let table = || TableOptions { known_joints: known_joints.clone(), ..TableOptions::default() };
        match Format::of(path) {
            Format::JsonLines => {
                Ok(Opened { recording: Recording::read(path)?, notes: Vec::new(), images: Vec::new() })
            }
            Format::Bag => Bag::read(path, &bag()).map(Opened::from),
            Format::Csv => Table::read_csv(path, &table()).map(Opened::from),
            Format::Parquet => Table::read_parquet(path, &table()).map(Opened::from),
            Format::LeRobot => Table::read_lerobot(path, &table()).map(Opened::from),
        }
    }
}

impl From<Bag> for Opened {
    fn from(Bag { recording, notes }: Bag) -> Opened {
        Opened { recording, notes, images: Vec::new() }
    }
}

impl From<Table> for Opened {
    fn from(Table { recording, images, notes }: Table) -> Opened {
        Opened { recording, notes, images }
    }
}
