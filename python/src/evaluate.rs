//! `evaluate` and `residuals`: how well a rig predicts a recording.
use crate::arrays::{NewArray, array};
use crate::errors::raise;
use crate::recording::Recording;
use crate::rig::AnyRig;
use handeye::calibrate::{self as library, CameraErrors, Finding};
use handeye::report::{self, About};
use handeye::rig::replace_file;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Distances between what a rig predicts and what was seen; those in px are of pixels, those in m of points of depth cameras, 0 where
/// there are none.
#[pyclass(module = "handeye", frozen, get_all)]
#[derive(Clone)]
pub struct Errors {
    /// How many detections were compared, pixels and points.
    observations: usize,
    /// How many were left out as wrong.
    rejected: usize,
    /// Root mean square [px].
    rms_px: f64,
    /// Mean [px].
    mean_px: f64,
    /// Median [px].
    median_px: f64,
    /// Largest [px].
    max_px: f64,
    /// How many are predicted behind the camera.
    behind: usize,
    /// How many of the detections are points.
    points: usize,
    /// Root mean square of the points [m].
    rms_m: f64,
    /// Mean of the points [m].
    mean_m: f64,
    /// Median of the points [m].
    median_m: f64,
    /// Largest of the points [m].
    max_m: f64,
}

#[pymethods]
impl Errors {
    fn __repr__(&self) -> String {
        let points = if self.points > 0 { format!(", points {:.3} mm", 1e3 * self.rms_m) } else { String::new() };
        format!("<handeye.Errors {} detections, {:.3} px rms{points}>", self.observations, self.rms_px)
    }
}

impl Errors {
    pub fn new(errors: &library::Errors, rejected: usize) -> Self {
        let points = &errors.points;
        Errors {
            observations: errors.observations,
            rejected,
            rms_px: errors.rms_px,
            mean_px: errors.mean_px,
            median_px: errors.median_px,
            max_px: errors.max_px,
            behind: errors.behind,
            points: points.observations,
            rms_m: points.rms_m,
            mean_m: points.mean_m,
            median_m: points.median_m,
            max_m: points.max_m,
        }
    }
}

/// Errors by camera, in the rig's order.
pub fn by_camera<'py>(py: Python<'py>, cameras: &[CameraErrors]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for camera in cameras {
        dict.set_item(&camera.name, Errors::new(&camera.errors, camera.rejected).into_pyobject(py)?)?;
    }
    Ok(dict)
}

/// How well a rig predicts a recording.
#[pyclass(module = "handeye", frozen)]
pub struct Evaluation {
    inner: library::Evaluation,
    rig: handeye::rig::Rig,
    recording: Arc<handeye::recording::Recording>,
    notes: Vec<String>,
}

#[pymethods]
impl Evaluation {
    /// Samples with joints or a tip pose, and at least one comparable detection.
    #[getter]
    fn samples(&self) -> usize {
        self.inner.samples
    }

    /// How many detections were compared.
    #[getter]
    fn observations(&self) -> usize {
        self.inner.total.observations
    }

    /// Detections whose camera, feature or sample's state the rig does not know.
    #[getter]
    fn rejected(&self) -> usize {
        self.inner.rejected
    }

    /// Root mean square of the pixel distances [px].
    #[getter]
    fn rms_px(&self) -> f64 {
        self.inner.total.rms_px
    }

    /// Mean pixel distance [px].
    #[getter]
    fn mean_px(&self) -> f64 {
        self.inner.total.mean_px
    }

    /// Median pixel distance [px].
    #[getter]
    fn median_px(&self) -> f64 {
        self.inner.total.median_px
    }

    /// Median, and what 95 % do not exceed, of the pixel distances as lengths at the depth of each feature [m]; ``None`` where the rig's lengths
    /// are no metres.
    #[getter]
    fn in_space(&self) -> Option<(f64, f64)> {
        self.inner.space.map(|space| (space.median_m, space.p95_m))
    }

    /// True where the rig was learned from this recording, as far as its file tells: the figures then say how well it was fitted.
    #[getter]
    fn learned_from_it(&self) -> bool {
        self.inner.is_own
    }

    /// Over all cameras.
    #[getter]
    fn total(&self) -> Errors {
        Errors::new(&self.inner.total, self.inner.rejected)
    }

    /// By camera.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_camera(py, &self.inner.cameras)
    }

    /// Median pixel distance of every sample [px], shape (samples,); NaN where nothing was compared.
    #[getter]
    fn sample_median_px<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        let medians: Vec<f64> = self.inner.sample_median_px.iter().map(|median| median.unwrap_or(f64::NAN)).collect();
        array(py, &[medians.len()], medians)
    }

    /// What does not fit, in words.
    #[getter]
    fn findings(&self) -> Vec<String> {
        self.inner.misfits.iter().chain(&self.inner.fitting.findings).map(Finding::of_evaluation).collect()
    }

    /// What a reader may do, in sentences; judged without what does not fit.
    #[getter]
    fn steps(&self) -> Vec<String> {
        report::evaluation_steps(&self.rig, &self.inner)
    }

    /// One self-contained HTML page about it, which is written to a file. ``title`` stands at its top.
    #[pyo3(signature = (path, title = None))]
    fn report(&self, py: Python<'_>, path: PathBuf, title: Option<&str>) -> PyResult<()> {
        let page = self.html(py, title)?;
        replace_file(&path, |file| file.write_all(page.as_bytes())).map_err(raise)
    }

    /// The same page as text.
    #[pyo3(signature = (title = None))]
    fn html(&self, py: Python<'_>, title: Option<&str>) -> PyResult<String> {
        let about = About { title: title.unwrap_or("A rig on a recording"), command: "", notes: &self.notes };
        py.detach(|| report::evaluation_html(&about, &self.rig, &self.recording, &self.inner)).map_err(raise)
    }

    fn __repr__(&self) -> String {
        let library::Evaluation { samples, total, .. } = &self.inner;
        let points = &total.points;
        let px = (total.observations > points.observations).then(|| format!(", {:.3} px rms", total.rms_px));
        let mm = (points.observations > 0).then(|| format!(", points {:.3} mm rms", 1e3 * points.rms_m));
        let figures: String = px.into_iter().chain(mm).collect();
        format!("<handeye.Evaluation {samples} samples, {} detections{figures}>", total.observations)
    }

    /// What a person wants to know first.
    fn __str__(&self) -> String {
        let mut lines = vec![self.__repr__().trim_matches(['<', '>']).trim_start_matches("handeye.").to_owned()];
        lines.extend(self.inner.space.map(|space| {
            let [median, most] = [space.median_m, space.p95_m].map(|length| 1e3 * length);
            format!("in space: {median:.3} mm in the median, 95 % no more than {most:.3} mm")
        }));
        lines.extend(self.findings().iter().map(|line| format!("does not fit: {line}")));
        lines.extend(self.steps());
        lines.join("\n")
    }
}

/// Predicts every detection of a recording from its joints, or from its tip's pose where it has none, and compares.
///
/// Raises ``UnusableInput`` where the rig is not complete or has another number of joints, ``NotDone`` where there is nothing to compare.
#[pyfunction]
pub fn evaluate(py: Python<'_>, rig: AnyRig<'_>, recording: &Recording) -> PyResult<Evaluation> {
    let (rig, notes, recording) = (&rig.inner, recording.notes.clone(), &recording.inner);
    let inner = py.detach(|| library::evaluate(rig, recording)).map_err(raise)?;
    Ok(Evaluation { inner, rig: rig.clone(), recording: recording.clone(), notes })
}

/// Predicted minus seen of every pixel [px]: camera -> (samples, features, 2), NaN where nothing was seen or the rig knows no camera or
/// feature of the name. Features are in the order of ``recording.feature_names``; noisy readings are refined by what was seen first.
///
/// Raises ``UnusableInput`` where the rig is not complete or has another number of joints.
#[pyfunction]
pub fn residuals<'py>(py: Python<'py>, rig: AnyRig<'_>, recording: &Recording) -> PyResult<Bound<'py, PyDict>> {
    let (rig, recording) = (&rig.inner, &recording.inner);
    let found = py.detach(|| report::residuals(rig, recording)).map_err(raise)?;
    let (samples, features) = (recording.samples.len(), recording.features.len());
    let places: BTreeMap<&str, usize> =
        recording.features.iter().enumerate().map(|(i, name)| (name.as_str(), i)).collect();
    let places: Vec<Option<usize>> =
        rig.features.iter().map(|feature| places.get(feature.name.as_str()).copied()).collect();
    let mut of_camera: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for residual in found {
        let Some(place) = places[residual.feature] else { continue };
        let numbers = of_camera.entry(residual.camera).or_insert_with(|| vec![f64::NAN; samples * features * 2]);
        numbers[2 * (residual.sample * features + place)..][..2].copy_from_slice(&residual.error);
    }
    let dict = PyDict::new(py);
    for (camera, numbers) in of_camera {
        dict.set_item(&rig.cameras[camera].name, array(py, &[samples, features, 2], numbers))?;
    }
    Ok(dict)
}
