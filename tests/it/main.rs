//! What users are promised, one file per promise.
mod cli;
mod cli_calibrate;
mod malformed_input;
mod readme;
mod recording_files;
mod rig_files;
mod simulate;
mod tidy;
