//! The Parquet files of a dataset as one table.
use super::Rows;
use super::lerobot::Info;
use super::parquet::Parquet;
use crate::Error;
use std::path::{Path, PathBuf};

/// Files that are read one after the other, all with the same columns.
pub(super) struct Dataset<'a> {
    folder: String,
    info: &'a Info,
    /// The file that is being read.
    file: Parquet,
    /// Those after it.
    files: std::vec::IntoIter<PathBuf>,
}

impl<'a> Dataset<'a> {
    /// `files`: one at least.
    pub(super) fn open(folder: &Path, files: Vec<PathBuf>, info: &'a Info) -> Result<Dataset<'a>, Error> {
        let folder = folder.display().to_string();
        let mut files = files.into_iter();
        let first = files.next().ok_or_else(|| Error::Unusable(format!("{folder}: has no data files")))?;
        Ok(Dataset { folder, info, file: Parquet::open(&first, info)?, files })
    }
}

impl Rows for Dataset<'_> {
    fn header(&self) -> &[String] {
        self.file.header()
    }

    fn next(&mut self, wanted: &[bool], row: &mut Vec<f64>) -> Result<bool, Error> {
        while !self.file.next(wanted, row)? {
            let Some(path) = self.files.next() else { return Ok(false) };
            let next = Parquet::open(&path, self.info)?;
            if next.header() != self.file.header() {
                let [before, after] = [&self.file, &next].map(|file| file.header().join(", "));
                let file = path.display();
                return Err(Error::Unusable(format!(
                    "{file}: has the columns {after}, and the file before has {before}"
                )));
            }
            self.file = next;
        }
        Ok(true)
    }

    fn is_in_seconds(&self, column: usize) -> bool {
        self.file.is_in_seconds(column)
    }

    fn left_out(&self) -> &[String] {
        self.file.left_out()
    }

    fn notes(&self) -> &[String] {
        self.file.notes()
    }

    fn error(&self, column: usize, problem: String) -> Error {
        self.file.error(column, problem)
    }

    fn file(&self) -> String {
        self.folder.clone()
    }
}
