//! Errors as Python exceptions, which `handeye/_errors.py` defines.
use handeye::Error;
use pyo3::PyErr;

mod class {
    pyo3::import_exception!(handeye._errors, UnusableInput);
    pyo3::import_exception!(handeye._errors, NotDone);
}

/// The exception for an error: `UnusableInput` where the command would end with status 2, `NotDone` where with 1.
pub fn raise(error: Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Malformed { file, line, column, .. } => class::UnusableInput::new_err((message, file, line, column)),
        error if error.is_input() => class::UnusableInput::new_err(message),
        _ => class::NotDone::new_err(message),
    }
}

/// `UnusableInput` with a message.
pub fn unusable(message: impl Into<String>) -> PyErr {
    class::UnusableInput::new_err(message.into())
}

/// `NotDone` with a message.
pub fn not_done(message: impl Into<String>) -> PyErr {
    class::NotDone::new_err(message.into())
}
