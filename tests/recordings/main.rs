//! Real recordings and the peers' problems, where they are there: beside the project, or where HANDEYE_SHARED says.
//!
//! `cargo test --test recordings`; not part of the plain `cargo test`, which needs nothing but this project.
mod doctor;
mod dvrk;
mod franka;
mod peers;
mod servo;
mod ur3e;

use handeye::calibrate::{Calibration, Options, calibrate};
use handeye::recording::Recording;
use handeye::rig::Rig;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// The folder of the recordings, or `None` with a line that says so.
fn shared(below: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("HANDEYE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let path = folder.join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!("NOTHING TO RUN ON: {} is not there (set HANDEYE_SHARED to its folder)", path.display());
    None
}

/// Learns with the default options, watched by nobody.
fn learn(rig: &Rig, recording: &Recording) -> Calibration {
    calibrate(rig, recording, &Options::default(), &mut |_| ControlFlow::Continue(())).expect("there is enough data")
}
