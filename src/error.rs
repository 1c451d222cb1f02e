//! Everything that can go wrong, with its place and what would do.
mod spelling;

pub(crate) use spelling::{shipped, suggestion};
use std::path::{Path, PathBuf};

/// Why a piece of work was not done. Messages are lower case, without a full stop, and name the place first.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A file was read, and something in it is unusable.
    #[error("{file}:{line}:{column}: {problem}")]
    Malformed {
        /// The file, as the user named it.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What was found, and what would do.
        problem: String,
    },
    /// Inputs that are fine by themselves do not fit together, or an argument is out of range.
    #[error("{0}")]
    Unusable(String),
    /// The data do not suffice, and what is missing.
    #[error("{0}")]
    NotEnoughData(String),
    /// An observer broke the work off.
    #[error("cancelled")]
    Cancelled,
    /// The minimiser was given a problem that it cannot work on.
    #[error(transparent)]
    Solver(#[from] handeye_solvers::Error),
}

impl Error {
    /// True where the input or the arguments are at fault (exit status 2), false where the work could not be done (1).
    pub fn is_input(&self) -> bool {
        matches!(self, Error::Io { .. } | Error::Malformed { .. } | Error::Unusable(_))
    }

    /// What the operating system said of a file.
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Error::Io { path: path.to_owned(), source }
    }

    /// A problem at a byte offset of a text, which becomes line and column.
    pub(crate) fn at(file: &str, text: &str, offset: usize, problem: String) -> Self {
        let before = &text[..text.floor_char_boundary(offset)];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line = 1 + before.matches('\n').count();
        Error::Malformed { file: file.to_owned(), line, column: 1 + before[line_start..].chars().count(), problem }
    }
}
