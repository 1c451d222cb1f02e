//! The class `Recording`: files and bags in, numpy arrays out.
use crate::arrays::{Floats, NewArray, array, rows};
use crate::errors::{raise, unusable};
use crate::recording_arrays::{Arrays, read_camera};
use crate::rig::AnyRig;
use handeye::recording::{
    self, Actions, Angles, BagOptions, Format, OpenOptions, Opened, RecordedCamera, TableOptions, WithoutEffect,
};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};
use std::collections::BTreeMap;
use std::ffi::CString;
use std::path::PathBuf;
use std::sync::Arc;

/// What was commanded, read and seen while a robot moved: samples of joint readings, tip poses, and pixels, points and targets in cameras.
///
/// Read from JSON Lines or ROS 2 bags (``load``) or made of arrays (``from_arrays``), and given back as arrays in which what was not
/// measured is NaN. It does not change. Units: metres, radians, seconds, pixels; pixel (0, 0) is the centre of the top-left one.
#[pyclass(module = "handeye", frozen, eq)]
#[derive(Clone)]
pub struct Recording {
    pub inner: Arc<recording::Recording>,
    pub notes: Vec<String>,
}

impl PartialEq for Recording {
    fn eq(&self, other: &Self) -> bool {
        self.inner == other.inner
    }
}

impl From<recording::Recording> for Recording {
    fn from(recording: recording::Recording) -> Self {
        Recording { inner: Arc::new(recording), notes: Vec::new() }
    }
}

/// One path, or several.
#[derive(FromPyObject)]
pub enum Paths {
    One(PathBuf),
    Several(Vec<PathBuf>),
}

/// Which joints are in degrees: no names for all of them, `None` for none.
fn in_degrees(given: &Bound<'_, PyAny>) -> PyResult<Option<Vec<String>>> {
    if let Ok(all) = given.extract::<bool>() {
        return Ok(all.then(Vec::new));
    }
    let names = given.extract::<String>().map(|name| vec![name]).or_else(|_| given.extract::<Vec<String>>());
    match names {
        Ok(names) => Ok((!names.is_empty()).then_some(names)),
        Err(_) => Err(unusable(format!("degrees: true, or names of joints, are meant, and not {}", given.repr()?))),
    }
}

#[pymethods]
impl Recording {
    /// Reads recordings: ROS 2 bags (``.mcap``), tables (``.csv``, ``.tsv``, ``.parquet``), LeRobot datasets (a folder), and JSON Lines;
    /// several of one robot are joined in their order.
    ///
    /// rig: its joints give names and order; joints: names from base to tip, of those in the file. cameras: name -> calibration file (YAML of ROS,
    /// OpenCV or Kalibr), or what is known as in ``from_arrays``; a lens replaces that of the file. still: one sample of each standstill of the
    /// robot, and none of its motions. joint_delay [s]: what is added to the stamps of the robot's readings, where its clock is behind the cameras'.
    ///
    /// For bags: ``joint_topic`` and ``pose_topic``, where there are several; ``frames``, (base, tip) for tip poses from TF;
    /// ``camera_topics``, topic -> name of the camera or ``None`` (that of its frame); ``join`` [s], by how much images of one sample may
    /// differ. For tables: ``degrees``, true or names, where joints are in degrees without saying so; ``radians``, where they are not even
    /// beyond two turns; ``actions``, whether LeRobot's are ``"targets"`` or ``"motions"`` (left out otherwise); ``episodes``, those to read.
    ///
    /// What has to be said of a file (states that were interpolated, samples left out) is in ``notes``, and comes as a warning. Raises
    /// ``UnusableInput`` with file, line and column for whatever is wrong inside, and for options without effect.
    #[staticmethod]
    #[pyo3(signature = (paths, *, rig = None, joint_topic = None, joints = None, pose_topic = None, frames = None, camera_topics = None, join = None,
        joint_delay = None, degrees = None, radians = false, actions = None, episodes = None, cameras = None, still = false))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per option")]
    fn load(
        py: Python<'_>,
        paths: Paths,
        rig: Option<AnyRig<'_>>,
        joint_topic: Option<String>,
        joints: Option<Vec<String>>,
        pose_topic: Option<String>,
        frames: Option<[String; 2]>,
        camera_topics: Option<BTreeMap<String, Option<String>>>,
        join: Option<f64>,
        joint_delay: Option<f64>,
        degrees: Option<Bound<'_, PyAny>>,
        radians: bool,
        actions: Option<&str>,
        episodes: Option<Vec<u64>>,
        cameras: Option<Bound<'_, PyDict>>,
        still: bool,
    ) -> PyResult<Self> {
        let paths = match paths {
            Paths::One(path) => vec![path],
            Paths::Several(paths) => paths,
        };
        let degrees = degrees.as_ref().map(in_degrees).transpose()?.flatten();
        if degrees.is_some() && radians {
            return Err(unusable("degrees and radians: joints are in one of them"));
        }
        let angles = match degrees {
            Some(names) => Angles::Degrees(names),
            None if radians => Angles::Radians,
            None => Angles::Unsaid,
        };
        let actions = match actions {
            None => Actions::Unsaid,
            Some("targets") => Actions::Targets,
            Some("motions") => Actions::Motions,
            Some(other) => return Err(unusable(format!("actions: `{other}` is neither targets nor motions"))),
        };
        let options = OpenOptions {
            joints: joints.unwrap_or_default(),
            known_joints: rig.as_ref().map_or_else(Vec::new, |rig| rig.inner.robot.joint_names()),
            cameras: cameras
                .iter()
                .flatten()
                .map(|(name, known)| read_camera(&name, &known))
                .collect::<PyResult<_>>()?,
            still,
            joint_delay,
            bag: BagOptions {
                joint_topic,
                pose_topic,
                frames,
                camera_topics: camera_topics.into_iter().flatten().collect(),
                join,
            },
            table: TableOptions { angles, actions, episodes: episodes.unwrap_or_default() },
        };
        let formats: Vec<Format> = paths.iter().map(|path| Format::of(path)).collect();
        if let Some(WithoutEffect { option, of }) = options.without_effect(&formats) {
            return Err(unusable(format!("{option}: none of the recordings is {of}, so that it has no effect")));
        }
        let read = py.detach(|| recording::Recording::open_all(&paths, &options));
        let Opened { recording, notes, .. } = read.map_err(raise)?;
        let inner = Arc::new(recording);
        for note in &notes {
            let text = CString::new(note.replace('\0', " ")).expect("without the byte 0");
            PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
        }
        Ok(Recording { inner, notes })
    }

    /// Reads the text of a recording as JSON Lines, which messages call ``file_name``.
    #[staticmethod]
    #[pyo3(signature = (text, file_name = "recording.jsonl"))]
    fn from_string(text: &str, file_name: &str) -> PyResult<Self> {
        Ok(recording::Recording::read_from(text.as_bytes(), file_name).map_err(raise)?.into())
    }

    /// A recording of arrays with one entry per sample along their first axis; NaN stands for what was not measured.
    ///
    /// joints: readings [rad or m], shape (samples, joints). pixels: camera -> (samples, features, 2) [px]. points: camera ->
    /// (samples, features, 3) in the camera's frame [m]. poses: world_from_tip, (samples, 4, 4). times: (samples,) [s].
    /// joint_actions, pose_actions: commanded motion to the next sample, (samples, joints) and (samples, 4, 4) with P_next = A P.
    /// targets: camera -> target -> camera_from_target, (samples, 4, 4); target_covariances likewise, (samples, 6, 6), of
    /// translation [m], then rotation vector [rad], along the camera's axes.
    ///
    /// Names: joint_names (j1, j2, ... where left out), feature_names (f0, f1, ...); cameras: name -> {"size": (w, h), "model": "pinhole",
    /// "fx": ..., "fy": ..., "cx": ..., "cy": ..., "distortion": [...]}, as far as known, or a calibration file. With ``rig``, its names and
    /// lenses.
    ///
    /// Raises ``UnusableInput`` where shapes or names do not fit together.
    #[staticmethod]
    #[pyo3(signature = (joints = None, pixels = None, *, times = None, poses = None, points = None, targets = None, target_covariances = None,
        joint_actions = None, pose_actions = None, joint_names = None, feature_names = None, cameras = None, rig = None))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per kind of measurement")]
    fn from_arrays(
        joints: Option<Floats<'_>>,
        pixels: Option<ByName<'_>>,
        times: Option<Floats<'_>>,
        poses: Option<Floats<'_>>,
        points: Option<ByName<'_>>,
        targets: Option<ByTwoNames<'_>>,
        target_covariances: Option<ByTwoNames<'_>>,
        joint_actions: Option<Floats<'_>>,
        pose_actions: Option<Floats<'_>>,
        joint_names: Option<Vec<String>>,
        feature_names: Option<Vec<String>>,
        cameras: Option<Bound<'_, PyDict>>,
        rig: Option<AnyRig<'_>>,
    ) -> PyResult<Self> {
        let [pixels, points] = [pixels, points].map(|of| of.map_or_else(Vec::new, |of| of.0));
        let [targets, target_covariances] = [targets, target_covariances].map(|of| of.map_or_else(Vec::new, |of| of.0));
        let arrays = Arrays {
            joints,
            pixels,
            times,
            poses,
            points,
            targets,
            target_covariances,
            joint_actions,
            pose_actions,
            joint_names,
            feature_names,
            cameras,
            rig: rig.as_ref().map(|rig| &rig.inner),
        };
        Ok(arrays.recording()?.checked().map_err(raise)?.into())
    }

    /// Writes a recording as JSON Lines, whole or not at all.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        self.inner.write(&path).map_err(raise)
    }

    /// The recording as JSON Lines, as ``save`` writes it.
    fn to_jsonl(&self) -> PyResult<String> {
        let mut text = Vec::new();
        self.inner.write_to(&mut text).map_err(|error| unusable(error.to_string()))?;
        String::from_utf8(text).map_err(|error| unusable(error.to_string()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((py.get_type::<Recording>().getattr("from_string")?, (self.to_jsonl()?,)))
    }

    fn __len__(&self) -> usize {
        self.inner.samples.len()
    }

    fn __repr__(&self) -> String {
        let recording = &self.inner;
        let (samples, joints) = (recording.samples.len(), recording.joints.len());
        let (cameras, features) = (recording.cameras.len(), recording.features.len());
        format!("<handeye.Recording {samples} samples, {joints} joints, {cameras} cameras, {features} features>")
    }

    /// Some samples in their order, by slice.
    fn __getitem__(&self, slice: &Bound<'_, PySlice>) -> PyResult<Self> {
        let range = slice.indices(self.inner.samples.len() as isize)?;
        if range.step <= 0 {
            return Err(unusable("samples stay in their order: a step above 0 would do"));
        }
        Ok(self.keep(|index| {
            let index = index as isize;
            (range.start..range.stop).contains(&index) && (index - range.start) % range.step == 0
        }))
    }

    /// The samples of these indices, from 0, in the recording's order. An action whose next sample is left out is dropped.
    fn select(&self, indices: Vec<usize>) -> PyResult<Self> {
        let n = self.inner.samples.len();
        let mut kept = vec![false; n];
        for index in indices {
            *kept.get_mut(index).ok_or_else(|| unusable(format!("sample {index} of {n}")))? = true;
        }
        Ok(self.keep(|index| kept[index]))
    }

    /// What has to be said of the files that it was read from, one line each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Names of the joints, from base to tip.
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.inner.joints.clone()
    }

    /// Names of the cameras, in the order of the header.
    #[getter]
    fn camera_names(&self) -> Vec<&str> {
        self.inner.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    /// Names of the features in natural order (f2 before f10): the order of the arrays.
    #[getter]
    fn feature_names(&self) -> Vec<String> {
        self.inner.features.clone()
    }

    /// What is known of the cameras: name -> {"size": (w, h), "model", "fx", "fy", "cx", "cy", "distortion"}, as ``from_arrays`` takes it.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for camera in &self.inner.cameras {
            dict.set_item(&camera.name, known(py, camera)?)?;
        }
        Ok(dict)
    }

    /// Times of the samples [s], shape (samples,); ``None`` where there is none.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Option<NewArray<'py>> {
        self.lists(py, &[], |sample| sample.time.map(|time| vec![time]))
    }

    /// Joint readings [rad or m], shape (samples, joints); ``None`` where there is none.
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> Option<NewArray<'py>> {
        self.lists(py, &[self.inner.joints.len()], |sample| sample.joints.clone())
    }

    /// world_from_tip, shape (samples, 4, 4); ``None`` where there is none.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> Option<NewArray<'py>> {
        self.lists(py, &[4, 4], |sample| sample.pose.as_ref().map(|pose| rows(pose).to_vec()))
    }

    /// Commanded joint motions to the next sample [rad or m], shape (samples, joints); ``None`` where there is none.
    #[getter]
    fn joint_actions<'py>(&self, py: Python<'py>) -> Option<NewArray<'py>> {
        self.lists(py, &[self.inner.joints.len()], |sample| sample.joint_action.clone())
    }

    /// Commanded motions A to the next sample, P_next = A P, shape (samples, 4, 4); ``None`` where there is none.
    #[getter]
    fn pose_actions<'py>(&self, py: Python<'py>) -> Option<NewArray<'py>> {
        self.lists(py, &[4, 4], |sample| sample.pose_action.as_ref().map(|pose| rows(pose).to_vec()))
    }

    /// Where features were seen [px]: camera -> (samples, features, 2), NaN where not seen.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.detections(py, |sample| sample.pixels.iter().map(|seen| (seen.camera, seen.feature, seen.pixel)).collect())
    }

    /// Where depth cameras saw features, in their frames [m]: camera -> (samples, features, 3), NaN where not seen. Of cameras that have any.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.detections(py, |sample| sample.points.iter().map(|seen| (seen.camera, seen.feature, seen.point)).collect())
    }

    /// Targets that were seen as whole poses: camera -> target -> camera_from_target, (samples, 4, 4), NaN where not seen.
    #[getter]
    fn targets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let n = self.inner.samples.len();
        let mut found: BTreeMap<(u32, &str), Vec<f64>> = BTreeMap::new();
        for (index, sample) in self.inner.samples.iter().enumerate() {
            for seen in &sample.targets {
                let numbers = found.entry((seen.camera, &seen.target)).or_insert_with(|| vec![f64::NAN; 16 * n]);
                numbers[16 * index..][..16].copy_from_slice(&rows(&seen.pose));
            }
        }
        let dict = PyDict::new(py);
        for ((camera, target), numbers) in found {
            let camera = &self.inner.cameras[camera as usize].name;
            let of_camera = match dict.get_item(camera)? {
                Some(known) => known.cast_into::<PyDict>()?,
                None => {
                    let new = PyDict::new(py);
                    dict.set_item(camera, &new)?;
                    new
                }
            };
            of_camera.set_item(target, array(py, &[n, 4, 4], numbers))?;
        }
        Ok(dict)
    }
}

impl Recording {
    fn keep(&self, keep: impl Fn(usize) -> bool) -> Self {
        Recording { inner: Arc::new(self.inner.select(keep)), notes: self.notes.clone() }
    }

    /// One entry of a shape per sample, NaN where a sample has none; `None` where all have none.
    fn lists<'py>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        of: impl Fn(&recording::Sample) -> Option<Vec<f64>>,
    ) -> Option<NewArray<'py>> {
        let lists: Vec<Option<Vec<f64>>> = self.inner.samples.iter().map(of).collect();
        if lists.iter().all(Option::is_none) {
            return None;
        }
        let missing = vec![f64::NAN; shape.iter().product()];
        let numbers = lists.iter().flat_map(|list| list.as_ref().unwrap_or(&missing)).copied().collect();
        Some(array(py, &[&[lists.len()], shape].concat(), numbers))
    }

    /// Detections as one array per camera that has any.
    fn detections<'py, const N: usize>(
        &self,
        py: Python<'py>,
        of: impl Fn(&recording::Sample) -> Vec<(u32, u32, [f64; N])>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (n, features) = (self.inner.samples.len(), self.inner.features.len());
        let mut found: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for (index, sample) in self.inner.samples.iter().enumerate() {
            for (camera, feature, numbers) in of(sample) {
                let all = found.entry(camera).or_insert_with(|| vec![f64::NAN; n * features * N]);
                all[(index * features + feature as usize) * N..][..N].copy_from_slice(&numbers);
            }
        }
        let dict = PyDict::new(py);
        for (camera, numbers) in found {
            dict.set_item(&self.inner.cameras[camera as usize].name, array(py, &[n, features, N], numbers))?;
        }
        Ok(dict)
    }
}

fn known<'py>(py: Python<'py>, camera: &RecordedCamera) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    if let Some([width, height]) = camera.size {
        dict.set_item("size", (width, height))?;
    }
    if let Some(model) = camera.model {
        dict.set_item("model", model.name())?;
    }
    for (key, value) in [("fx", camera.fx), ("fy", camera.fy), ("cx", camera.cx), ("cy", camera.cy)] {
        if let Some(value) = value {
            dict.set_item(key, value)?;
        }
    }
    if let Some(distortion) = &camera.distortion {
        dict.set_item("distortion", distortion.clone())?;
    }
    Ok(dict)
}

/// Camera -> array, in the order of the dictionary.
pub struct ByName<'py>(pub Vec<(String, Floats<'py>)>);

impl<'py> FromPyObject<'_, 'py> for ByName<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let pairs = object.cast::<PyDict>()?.iter();
        pairs.map(|(name, array)| Ok((name.extract()?, array.extract()?))).collect::<PyResult<_>>().map(ByName)
    }
}

/// Camera -> target -> array.
pub struct ByTwoNames<'py>(pub Vec<(String, Vec<(String, Floats<'py>)>)>);

impl<'py> FromPyObject<'_, 'py> for ByTwoNames<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let pairs = object.cast::<PyDict>()?.iter();
        let pair = |(name, targets): (Bound<'py, PyAny>, Bound<'py, PyAny>)| {
            Ok((name.extract()?, targets.extract::<ByName<'py>>()?.0))
        };
        pairs.map(pair).collect::<PyResult<_>>().map(ByTwoNames)
    }
}
