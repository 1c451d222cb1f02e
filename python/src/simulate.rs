//! `simulate` and `random_rig`.
use crate::errors::{raise, unusable};
use crate::recording::Recording;
use crate::rig::{AnyRig, Rig};
use handeye::simulate::{self as library, SimulateOptions};
use pyo3::prelude::*;

/// A simulated recording, and what it would have been without noise.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct Simulation {
    /// What was commanded, read and seen, with noise, missed detections and outliers.
    recording: Recording,
    /// The true joints, tip poses, pixels and points of the same samples.
    truth: Recording,
    /// How many detections of features in view are missing.
    missed: usize,
    /// How many detections are gross outliers.
    outliers: usize,
}

#[pymethods]
impl Simulation {
    fn __repr__(&self) -> String {
        let samples = self.recording.inner.samples.len();
        format!("<handeye.Simulation {samples} samples, {} detections missed, {} outliers>", self.missed, self.outliers)
    }
}

/// Records random joint positions of a complete rig, uniform within the limits where its features are in view, with the rig's noise.
///
/// samples: how many. seed: the same seed gives the same recording, bit for bit. missed, outliers: probability that a detection is
/// missing, or is anywhere in the image, in [0, 1]. in_view: share of the features that every camera has in view in every sample.
/// min_features: least number in view in every sample, summed over the cameras.
///
/// Raises ``UnusableInput`` where the rig is not complete or an option is out of range, ``NotDone`` where hardly any position within the
/// limits has the features in view.
#[pyfunction]
#[pyo3(signature = (rig, samples = 50, seed = 1, *, missed = 0.0, outliers = 0.0, in_view = 0.5, min_features = 4))]
#[expect(clippy::too_many_arguments, reason = "one keyword per option")]
pub fn simulate(
    py: Python<'_>,
    rig: AnyRig<'_>,
    samples: usize,
    seed: u64,
    missed: f64,
    outliers: f64,
    in_view: f64,
    min_features: usize,
) -> PyResult<Simulation> {
    let options = SimulateOptions { samples, seed, missed, outliers, in_view, min_features };
    let rig = &rig.inner;
    let simulation = py.detach(|| library::simulate(rig, &options)).map_err(raise)?;
    let library::Simulation { recording, truth, missed, outliers } = simulation;
    Ok(Simulation { recording: recording.into(), truth: truth.into(), missed, outliers })
}

/// A rig drawn at random: an arm of so many revolute joints before so many cameras, with features on its tip; the same seed gives the same.
#[pyfunction]
#[pyo3(signature = (joints = 6, cameras = 2, features = 12, seed = 1))]
pub fn random_rig(joints: usize, cameras: usize, features: usize, seed: u64) -> PyResult<Rig> {
    if joints == 0 || cameras == 0 || features == 0 {
        return Err(unusable("a random rig has at least one joint, one camera and one feature"));
    }
    Ok(Rig { inner: library::random_rig(joints, cameras, features, seed), text: None })
}
