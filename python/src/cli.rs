//! The command `handeye`.
use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the command ``handeye`` with arguments, of which the first is the program's name, and returns its exit status.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| handeye::cli::run(arguments.into_iter()))
}
