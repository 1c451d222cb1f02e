//! Tables as recordings: CSV, and Parquet as LeRobot writes it. A column is one quantity, a row one sample.
//!
//! | column | meaning |
//! | --- | --- |
//! | `time` (`timestamp`, `t`), `time_ms`, `time_us`, `time_ns` | time |
//! | `joints.NAME`, or `NAME` where the options or the rig name the joint; `joints.NAME_deg` | joint reading |
//! | `joint_action.NAME`, `joint_action.NAME_deg` | commanded joint motion |
//! | `pose.x` `.y` `.z` with `.qx` `.qy` `.qz` `.qw` or `.roll` `.pitch` `.yaw`; `pose_action.…` | pose of the tip, commanded motion |
//! | `image` (`file`, `filename`) | the image that belongs to the row |
//! | `CAMERA.FEATURE.u` `.v` | pixel |
//! | `CAMERA.FEATURE.x` `.y` `.z` | point in the camera's frame |
//! | `CAMERA.TARGET.x` … `.qw` | pose of a target in the camera's frame |
//!
//! Times without a unit are seconds, or what makes them dates of this century, which is said. LeRobot's `observation.state` are joints, by the names
//! in `meta/info.json`; `action.NAME` are targets or motions of the joints of the same names, which the options say; where the numbers of `action`
//! have no names, they are of the joints in their order. Its images and whatever else begins with `observation.` or `next.` are passed over. What is
//! empty, null or not a number was not measured.
mod columns;
mod csv;
mod dataset;
mod lerobot;
mod parquet;
mod remarks;
mod samples;

use super::{OpenOptions, Opened};
use crate::Error;
use std::path::Path;

/// What of a table is meant, where its columns alone do not tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableOptions {
    /// The unit of joints whose column does not say it.
    pub angles: Angles,
    /// What `action.NAME`, LeRobot's `action`, holds.
    pub actions: Actions,
    /// Episodes to read (`episode_index`); empty: all.
    pub episodes: Vec<u64>,
}

/// The unit of joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Angles {
    /// Radians or metres as long as they could be: what is beyond two turns is refused.
    #[default]
    Unsaid,
    /// Radians or metres, whatever they are.
    Radians,
    /// These joints are in degrees, all where none is named.
    Degrees(Vec<String>),
}

/// What actions hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Actions {
    /// That is not known: they are left out.
    #[default]
    Unsaid,
    /// Joint positions to go to: the commanded motion is from the reading of the same row.
    Targets,
    /// Joint motions.
    Motions,
}

/// Reads a CSV file: values apart by `,`, `;` or tab, a header in the first line, comments in lines that begin with `#`.
///
/// Errors: [`Error::Io`], and [`Error::Malformed`] with the place of what cannot be read.
pub(super) fn read_csv(path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
    samples::read(csv::Csv::open(path)?, options, &[])
}

/// Reads a Parquet file of numbers, or of a LeRobot dataset, whose `meta/info.json` is looked for beside and above it.
///
/// Errors: [`Error::Io`], and [`Error::Unusable`] with row and column.
pub(super) fn read_parquet(path: &Path, options: &OpenOptions) -> Result<Opened, Error> {
    let info = lerobot::Info::find(path)?;
    samples::read(parquet::Parquet::open(path, &info)?, options, &info.cameras)
}

/// Reads all of a LeRobot dataset: the Parquet files in the folder `data` beside `meta/info.json`, in the order of their names.
///
/// Errors: those of [`read_parquet`], and [`Error::Unusable`] for a folder that is no dataset.
pub(super) fn read_lerobot(folder: &Path, options: &OpenOptions) -> Result<Opened, Error> {
    let files = lerobot::files(folder)?;
    let info = lerobot::Info::find(&files[0])?;
    samples::read(dataset::Dataset::open(folder, files, &info)?, options, &info.cameras)
}

/// A table that is read row by row.
trait Rows {
    /// Names of the columns.
    fn header(&self) -> &[String];

    /// The next row, one number per column, NaN where nothing was measured or the column is not wanted; false at the end.
    fn next(&mut self, wanted: &[bool], row: &mut Vec<f64>) -> Result<bool, Error>;

    /// The name of the image that belongs to the row that was read last, without folder and ending, where there is such a column.
    fn image(&self) -> Option<&str> {
        None
    }

    /// True where the numbers in a column are seconds, whatever its name says.
    fn is_in_seconds(&self, _column: usize) -> bool {
        false
    }

    /// What there is beside columns of numbers.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// What has to be said of the names of its columns.
    fn notes(&self) -> &[String] {
        &[]
    }

    /// A problem with a column of the row that was read last, or of the header before any.
    fn error(&self, column: usize, problem: String) -> Error;

    /// What messages call the file.
    fn file(&self) -> String;
}
