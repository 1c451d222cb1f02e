//! `Inference` and `infer`: joints and poses from what is seen.
use crate::arrays::{Floats, NewArray, array, homogeneous, list, matrix, rows, vector};
use crate::errors::{raise, unusable};
use crate::recording::Recording;
use crate::rig::AnyRig;
use crate::sight::Layout;
use handeye::Error;
use handeye::infer::{self as library, InferOptions, Names, PointSighting, Prior, Sighting, Sightings};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Infers joints and poses of a known rig from pixels and points; prepared once.
///
/// What is seen is camera -> (n_features, 2) [px], in the order of ``rig.feature_names``, NaN where not seen; points of depth cameras
/// likewise, (n_features, 3) [m].
#[pyclass(module = "handeye")]
pub struct Inference {
    inner: library::Inference,
    layout: Layout,
    n_joints: usize,
    pixels: Vec<Sighting>,
}

#[pymethods]
impl Inference {
    /// rig: complete. starts: of the inverse kinematics at most. pixel_starts: starts refined in pixels where the pixels give no pose of
    /// the tip. seed: the same seed gives the same result.
    #[new]
    #[pyo3(signature = (rig, *, starts = 60, pixel_starts = 60, seed = 1))]
    fn new(rig: AnyRig<'_>, starts: usize, pixel_starts: usize, seed: u64) -> PyResult<Self> {
        let inner = library::Inference::new(&rig.inner, InferOptions { starts, pixel_starts, seed }).map_err(raise)?;
        let (layout, n_joints) = (Layout::of(&rig.inner), rig.inner.robot.joints.len());
        Ok(Inference { inner, layout, n_joints, pixels: Vec::new() })
    }

    /// The branches of joints that explain what is seen, most probable first.
    ///
    /// near: joints where the search begins and where it stays in directions that are left open, shape (n_joints,). sd: standard
    /// deviations of ``near`` [rad or m] where it is a reading, (n_joints,); left out, it says nothing but where to begin.
    ///
    /// Raises ``NotDone`` where nothing that any joint moves was seen.
    #[pyo3(signature = (pixels, *, points = None, near = None, sd = None))]
    fn joints(
        &mut self,
        py: Python<'_>,
        pixels: &Bound<'_, PyDict>,
        points: Option<&Bound<'_, PyDict>>,
        near: Option<Floats<'_>>,
        sd: Option<Floats<'_>>,
    ) -> PyResult<Vec<Branch>> {
        let points = self.look(pixels, points)?;
        let prior = prior(near.as_ref(), sd.as_ref(), self.n_joints)?;
        let (inner, pixels) = (&mut self.inner, &self.pixels);
        let found = py.detach(|| inner.joints(Sightings { pixels, points: &points }, &prior)).map_err(raise)?;
        Ok(found.into_iter().map(|inner| Branch { inner }).collect())
    }

    /// The joints near a start: one local search, for tracking, some ten times faster than ``joints``.
    #[pyo3(signature = (pixels, near, *, points = None, sd = None))]
    fn joints_near(
        &mut self,
        py: Python<'_>,
        pixels: &Bound<'_, PyDict>,
        near: Floats<'_>,
        points: Option<&Bound<'_, PyDict>>,
        sd: Option<Floats<'_>>,
    ) -> PyResult<Branch> {
        let points = self.look(pixels, points)?;
        let prior = prior(Some(&near), sd.as_ref(), self.n_joints)?;
        let (inner, pixels) = (&mut self.inner, &self.pixels);
        let found = py.detach(|| inner.joints_near(Sightings { pixels, points: &points }, &prior));
        Ok(Branch { inner: found.map_err(raise)? })
    }

    /// The branches after a commanded motion: those of before, moved by it and weighed by what is seen now, most probable first.
    ///
    /// action: one number per joint [rad or m], with the rig's noise ``joint_action``.
    #[pyo3(signature = (before, action, pixels, *, points = None))]
    fn joints_after(
        &mut self,
        py: Python<'_>,
        before: Vec<PyRef<'_, Branch>>,
        action: Floats<'_>,
        pixels: &Bound<'_, PyDict>,
        points: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Vec<Branch>> {
        let points = self.look(pixels, points)?;
        let action = list("action", &action, self.n_joints)?;
        let before: Vec<library::Branch> = before.iter().map(|branch| branch.inner.clone()).collect();
        let (inner, pixels) = (&mut self.inner, &self.pixels);
        let found = py.detach(|| inner.joints_after(&before, &action, Sightings { pixels, points: &points }));
        Ok(found.map_err(raise)?.into_iter().map(|inner| Branch { inner }).collect())
    }

    /// Poses of the tip that explain what is seen, most probable first; empty where it leaves the pose open.
    #[pyo3(signature = (pixels, *, points = None))]
    fn poses(
        &mut self,
        py: Python<'_>,
        pixels: &Bound<'_, PyDict>,
        points: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Vec<InferredPose>> {
        let points = self.look(pixels, points)?;
        let (inner, pixels) = (&mut self.inner, &self.pixels);
        let found = py.detach(|| inner.poses(Sightings { pixels, points: &points }));
        Ok(found.into_iter().map(|inner| InferredPose { inner }).collect())
    }
}

impl Inference {
    fn look(&mut self, pixels: &Bound<'_, PyDict>, points: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<PointSighting>> {
        self.layout.pixels(pixels, &mut self.pixels)?;
        self.layout.points(points)
    }
}

fn prior(near: Option<&Floats<'_>>, sd: Option<&Floats<'_>>, n: usize) -> PyResult<Prior> {
    let Some(near) = near else {
        return match sd {
            None => Ok(Prior::none()),
            Some(_) => Err(unusable("sd: it is that of `near`, which is not given")),
        };
    };
    let mean = list("near", near, n)?;
    let sd = sd.map_or_else(|| Ok(Vec::new()), |sd| list("sd", sd, n))?;
    Ok(Prior { mean, sd })
}

/// Joints that explain what was seen.
#[pyclass(module = "handeye", frozen)]
pub struct Branch {
    inner: library::Branch,
}

#[pymethods]
impl Branch {
    /// One reading per joint, inside its limits [rad or m], shape (n_joints,).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.inner.joints)
    }

    /// Covariance of their error [rad² or m²], shape (n_joints, n_joints). What the rig itself is off by is not in it.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        matrix(py, &self.inner.covariance)
    }

    /// Unit directions of the joints that what was seen leaves open, shape (directions, n_joints).
    #[getter]
    fn open<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        let open = &self.inner.open;
        array(py, &[open.len(), self.inner.joints.len()], open.concat())
    }

    /// world_from_tip with these joints, shape (4, 4).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        homogeneous(py, &self.inner.pose)
    }

    /// Root mean square of the pixel distances that are left [px]; 0 without pixels.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.inner.rms_px
    }

    /// Root mean square of the distances of points that are left [m]; 0 without points.
    #[getter]
    fn rms_points_m(&self) -> f64 {
        self.inner.rms_points_m
    }

    /// How probable it is among the branches that were found.
    #[getter]
    fn probability(&self) -> f64 {
        self.inner.probability
    }

    fn __repr__(&self) -> String {
        let library::Branch { joints, rms_px, probability, .. } = &self.inner;
        format!("<handeye.Branch joints {joints:.4?}, {rms_px:.3} px rms, probability {probability:.4}>")
    }
}

/// A pose of the tip that explains what was seen.
#[pyclass(module = "handeye", frozen)]
pub struct InferredPose {
    inner: library::InferredPose,
}

#[pymethods]
impl InferredPose {
    /// world_from_tip, shape (4, 4).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        homogeneous(py, &self.inner.pose)
    }

    /// Covariance of its error: of the rotation vector [rad], then of the translation [m], along the world's axes; shape (6, 6).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[6, 6], self.inner.covariance.transpose().as_slice().to_vec())
    }

    /// Root mean square of the pixel distances that are left [px]; 0 without pixels.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.inner.rms_px
    }

    /// How probable it is among those that were found.
    #[getter]
    fn probability(&self) -> f64 {
        self.inner.probability
    }

    fn __repr__(&self) -> String {
        let library::InferredPose { pose, rms_px, probability, .. } = &self.inner;
        let t = pose.translation.as_slice();
        format!("<handeye.InferredPose at {t:.4?} m, {rms_px:.3} px rms, probability {probability:.4}>")
    }
}

/// What was inferred from a recording, sample by sample: the most probable branch in arrays, all of them in lists.
#[pyclass(module = "handeye", frozen)]
pub struct Inferred {
    n_joints: usize,
    branches: Vec<Vec<Py<Branch>>>,
    errors: Vec<Option<String>>,
}

/// Infers the joints and the tip's pose from each sample's pixels and points alone.
///
/// actions: branches are followed through the recorded joint actions, with the rig's noise ``joint_action``. readings: the joint readings
/// are used too, with the rig's noise ``joints``. A sample of which nothing can be told is NaN, with the reason in ``errors``.
#[pyfunction]
#[pyo3(signature = (rig, recording, *, actions = false, readings = false, seed = 1))]
pub fn infer(
    py: Python<'_>,
    rig: AnyRig<'_>,
    recording: &Recording,
    actions: bool,
    readings: bool,
    seed: u64,
) -> PyResult<Inferred> {
    let (rig, recording) = (&rig.inner, &recording.inner);
    if actions && readings {
        return Err(unusable("actions or readings, not both"));
    }
    if readings && rig.noise.joints <= 0.0 {
        return Err(unusable("readings: the noise `joints` of the rig is needed, above 0"));
    }
    if actions && recording.samples.iter().all(|sample| sample.joint_action.is_none()) {
        return Err(unusable("actions: no sample has a joint action"));
    }
    let mut inference =
        library::Inference::new(rig, InferOptions { seed, ..InferOptions::default() }).map_err(raise)?;
    let names = Names::new(rig, recording);
    let mut inferred = Inferred { n_joints: rig.robot.joints.len(), branches: Vec::new(), errors: Vec::new() };
    let mut before: Option<(Vec<library::Branch>, &[f64])> = None;
    for sample in &recording.samples {
        py.check_signals()?;
        let (pixels, points) = (names.sightings(sample), names.points(sample));
        let seen = Sightings { pixels: &pixels, points: &points };
        let found = py.detach(|| match (&before, &sample.joints) {
            (Some((branches, action)), _) => inference.joints_after(branches, action, seen),
            (None, Some(joints)) if readings => inference.joints(seen, &Prior::readings(joints, rig.noise.joints)),
            _ => inference.joints(seen, &Prior::none()),
        });
        let (branches, error) = match found {
            Ok(branches) => (branches, None),
            Err(Error::NotEnoughData(reason)) => (Vec::new(), Some(reason)),
            Err(error) => return Err(raise(error)),
        };
        let kept =
            branches.iter().map(|branch| Py::new(py, Branch { inner: branch.clone() })).collect::<PyResult<_>>()?;
        inferred.branches.push(kept);
        inferred.errors.push(error);
        let action = sample.joint_action.as_deref().filter(|_| actions && !branches.is_empty());
        before = action.map(|action| (branches, action));
    }
    Ok(inferred)
}

#[pymethods]
impl Inferred {
    /// Joints of the most probable branch [rad or m], shape (samples, n_joints).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        self.stacked(py, &[self.n_joints], |branch| branch.joints.clone())
    }

    /// Standard deviations of the joints [rad or m], shape (samples, n_joints).
    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        self.stacked(py, &[self.n_joints], |branch| branch.covariance.diagonal().iter().map(|v| v.sqrt()).collect())
    }

    /// Covariance of the joints, shape (samples, n_joints, n_joints).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        let n = self.n_joints;
        self.stacked(py, &[n, n], |branch| branch.covariance.transpose().as_slice().to_vec())
    }

    /// world_from_tip, shape (samples, 4, 4).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        self.stacked(py, &[4, 4], |branch| rows(&branch.pose).to_vec())
    }

    /// Root mean square of the pixel distances that are left [px], shape (samples,).
    #[getter]
    fn rms_px<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        self.stacked(py, &[], |branch| vec![branch.rms_px])
    }

    /// How probable the branch is among all that were found, shape (samples,).
    #[getter]
    fn probability<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        self.stacked(py, &[], |branch| vec![branch.probability])
    }

    /// All branches of every sample, most probable first.
    #[getter]
    fn branches(&self, py: Python<'_>) -> Vec<Vec<Py<Branch>>> {
        self.branches.iter().map(|of_sample| of_sample.iter().map(|branch| branch.clone_ref(py)).collect()).collect()
    }

    /// Why nothing was inferred, of every sample; ``None`` where something was.
    #[getter]
    fn errors(&self) -> Vec<Option<String>> {
        self.errors.clone()
    }

    fn __len__(&self) -> usize {
        self.branches.len()
    }

    fn __repr__(&self) -> String {
        let failed = self.errors.iter().flatten().count();
        format!("<handeye.Inferred {} samples, {failed} of them left open>", self.branches.len())
    }
}

impl Inferred {
    /// Something of the most probable branch of every sample, NaN where there is none.
    fn stacked<'py>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        of: impl Fn(&library::Branch) -> Vec<f64>,
    ) -> NewArray<'py> {
        let missing = vec![f64::NAN; shape.iter().product()];
        let one =
            |branches: &Vec<Py<Branch>>| branches.first().map_or_else(|| missing.clone(), |best| of(&best.get().inner));
        array(py, &[&[self.branches.len()], shape].concat(), self.branches.iter().flat_map(one).collect())
    }
}
