//! Learns a rig from a recording.
mod evaluate;
pub(crate) mod kinematics;
mod report;

pub use evaluate::{CameraErrors, Errors, Evaluation, evaluate};
pub use report::{Calibration, Finding, Report, StageReport, TipDeviation};

use crate::Error;
use crate::recording::Recording;
use crate::rig::Rig;
use std::ops::ControlFlow;

/// How to calibrate.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Seed of every random choice: the same seed gives the same rig, bit for bit.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Options { seed: 1 }
    }
}

/// What a calibration is doing, for progress bars; breaking off cancels it.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress<'a> {
    /// Name of the stage.
    pub stage: &'a str,
    /// Iterations or trials done in it.
    pub done: usize,
    /// Of how many at most.
    pub of: usize,
    /// Root mean square pixel distance where there is one [px].
    pub rms_px: Option<f64>,
}

/// Called as a calibration goes on.
pub type Observer<'a> = &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>;

/// Learns what is unknown of a rig from a recording, and refines the rest.
///
/// Fails with [`Error::NotEnoughData`] where the recording cannot determine the rig, naming what is missing, and with
/// [`Error::Unusable`] where rig and recording do not fit together.
pub fn calibrate(
    rig: &Rig,
    recording: &Recording,
    options: &Options,
    observer: Observer<'_>,
) -> Result<Calibration, Error> {
    let _ = (rig, recording, options, observer);
    Err(Error::NotEnoughData("not yet".into()))
}
