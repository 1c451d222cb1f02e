//! What users are promised, one file per promise.
mod calibration;
mod cli;
mod cli_calibrate;
mod determinism;
mod deviations;
mod folds;
mod learning;
mod malformed_input;
mod not_enough;
mod readme;
mod recording_files;
mod rig_files;
mod simulate;
mod states;
mod targets;
mod tidy;
mod wrong_data;
