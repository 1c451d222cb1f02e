//! A recording out of arrays.
use crate::arrays::{Floats, fixed, pose_or_none};
use crate::errors::{raise, unusable};
use handeye::camera::CameraModel;
use handeye::recording::{Detection, PointDetection, RecordedCamera, Recording, Sample, TargetDetection};
use handeye::rig::Rig;
use handeye::solvers::Pose;
use nalgebra::Matrix6;
use numpy::ndarray::{ArrayView1, Axis, Ix2, Ix3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// What `Recording.from_arrays` takes; dictionaries in their order.
pub struct Arrays<'a, 'py> {
    pub joints: Option<Floats<'py>>,
    pub pixels: Vec<(String, Floats<'py>)>,
    pub times: Option<Floats<'py>>,
    pub poses: Option<Floats<'py>>,
    pub points: Vec<(String, Floats<'py>)>,
    pub targets: Vec<(String, Vec<(String, Floats<'py>)>)>,
    pub target_covariances: Vec<(String, Vec<(String, Floats<'py>)>)>,
    pub joint_actions: Option<Floats<'py>>,
    pub pose_actions: Option<Floats<'py>>,
    pub joint_names: Option<Vec<String>>,
    pub feature_names: Option<Vec<String>>,
    pub cameras: Option<Bound<'py, PyDict>>,
    pub rig: Option<&'a Rig>,
}

impl Arrays<'_, '_> {
    /// The recording, whose names and numbers are still to be checked.
    pub fn recording(&self) -> PyResult<Recording> {
        let samples = vec![Sample::default(); self.count()?];
        let mut recording = Recording {
            joints: self.joint_names()?,
            cameras: self.recorded_cameras()?,
            features: self.feature_names()?,
            samples,
        };
        self.read_lists(&mut recording)?;
        for (name, array) in &self.pixels {
            let camera = camera_index(&mut recording, name);
            each(&recording.features, "pixels", name, array, &mut recording.samples, |sample, feature, pixel| {
                sample.pixels.push(Detection { camera, feature, pixel });
            })?;
        }
        for (name, array) in &self.points {
            let camera = camera_index(&mut recording, name);
            each(&recording.features, "points", name, array, &mut recording.samples, |sample, feature, point| {
                sample.points.push(PointDetection { camera, feature, point });
            })?;
        }
        self.read_targets(&mut recording)?;
        Ok(recording)
    }

    /// How many samples the arrays have, which must be the same of all.
    fn count(&self) -> PyResult<usize> {
        let of_option =
            |what: &str, array: &Option<Floats<'_>>| array.as_ref().map(|array| (what.to_owned(), first(array)));
        let of_list = |what: &'static str, list: &'_ [(String, Floats<'_>)]| -> Vec<(String, usize)> {
            list.iter().map(|(name, array)| (format!("{what} of `{name}`"), first(array))).collect()
        };
        let mut counts: Vec<(String, usize)> = Vec::new();
        counts.extend(of_option("joints", &self.joints));
        counts.extend(of_list("pixels", &self.pixels));
        counts.extend(of_option("times", &self.times));
        counts.extend(of_option("poses", &self.poses));
        counts.extend(of_list("points", &self.points));
        self.targets.iter().for_each(|(_, targets)| counts.extend(of_list("targets", targets)));
        self.target_covariances.iter().for_each(|(_, targets)| counts.extend(of_list("target_covariances", targets)));
        counts.extend(of_option("joint_actions", &self.joint_actions));
        counts.extend(of_option("pose_actions", &self.pose_actions));
        let Some((one, n)) = counts.first() else {
            return Err(unusable("no array is given: joints, pixels, poses, points or targets would do"));
        };
        match counts.iter().find(|(_, other)| other != n) {
            Some((other, m)) => Err(unusable(format!("{one} has {n} samples, {other} has {m}"))),
            None => Ok(*n),
        }
    }

    fn joint_names(&self) -> PyResult<Vec<String>> {
        let width =
            |array: &Option<Floats<'_>>| array.as_ref().and_then(|array| array.as_array().shape().get(1).copied());
        let n = width(&self.joints).or_else(|| width(&self.joint_actions)).unwrap_or(0);
        let of_rig = || self.rig.map(|rig| rig.robot.joint_names());
        let given = self.joint_names.clone().or_else(|| of_rig().filter(|names| !names.is_empty() && n > 0));
        let names = given.unwrap_or_else(|| (1..=n).map(|i| format!("j{i}")).collect());
        if n > 0 && names.len() != n {
            return Err(unusable(format!("joints of {n} columns, and {} names", names.len())));
        }
        Ok(names)
    }

    fn feature_names(&self) -> PyResult<Vec<String>> {
        let mut arrays = self.pixels.iter().chain(&self.points);
        let n = arrays.next().and_then(|(_, array)| array.as_array().shape().get(1).copied()).unwrap_or(0);
        let of_rig = || self.rig.map(|rig| rig.features.iter().map(|feature| feature.name.clone()).collect::<Vec<_>>());
        let given = self.feature_names.clone().or_else(|| of_rig().filter(|names| !names.is_empty()));
        Ok(given.unwrap_or_else(|| (0..n).map(|i| format!("f{i}")).collect()))
    }

    fn recorded_cameras(&self) -> PyResult<Vec<RecordedCamera>> {
        let mut cameras: Vec<RecordedCamera> =
            self.rig.map_or_else(Vec::new, |rig| rig.cameras.iter().map(RecordedCamera::from).collect());
        for (name, known) in self.cameras.iter().flatten() {
            let camera = read_camera(&name, &known)?;
            match cameras.iter_mut().find(|other| other.name == camera.name) {
                Some(other) => *other = camera,
                None => cameras.push(camera),
            }
        }
        Ok(cameras)
    }

    fn read_lists(&self, recording: &mut Recording) -> PyResult<()> {
        let n = recording.joints.len();
        let lists = |what: &str, array: &Option<Floats<'_>>| -> PyResult<Vec<Option<Vec<f64>>>> {
            let Some(array) = array else { return Ok(Vec::new()) };
            let rows = fixed::<Ix2>(what, array.as_array(), &format!("(samples, {n})"))?;
            Ok(rows.outer_iter().map(|row| measured(row.view())).collect())
        };
        for (sample, joints) in recording.samples.iter_mut().zip(lists("joints", &self.joints)?) {
            sample.joints = joints;
        }
        for (sample, action) in recording.samples.iter_mut().zip(lists("joint_actions", &self.joint_actions)?) {
            sample.joint_action = action;
        }
        for (sample, pose) in recording.samples.iter_mut().zip(poses("poses", &self.poses)?) {
            sample.pose = pose;
        }
        for (sample, action) in recording.samples.iter_mut().zip(poses("pose_actions", &self.pose_actions)?) {
            sample.pose_action = action;
        }
        if let Some(times) = &self.times {
            let view = times.as_array();
            if view.ndim() != 1 {
                return Err(unusable(format!("times: shape {:?}, and (samples,) would do", view.shape())));
            }
            for (sample, time) in recording.samples.iter_mut().zip(&view) {
                sample.time = (!time.is_nan()).then_some(*time);
            }
        }
        Ok(())
    }

    fn read_targets(&self, recording: &mut Recording) -> PyResult<()> {
        let known = |camera: &str, target: &str| {
            self.targets.iter().any(|(one, targets)| one == camera && targets.iter().any(|(one, _)| one == target))
        };
        for (camera, covariances) in &self.target_covariances {
            if let Some((target, _)) = covariances.iter().find(|(target, _)| !known(camera, target)) {
                return Err(unusable(format!(
                    "target_covariances: there are no `targets` of camera `{camera}`, `{target}`"
                )));
            }
        }
        for (name, targets) in &self.targets {
            let camera = camera_index(recording, name);
            for (target, array) in targets {
                let what = format!("targets of `{name}`, `{target}`");
                let of = self.target_covariances.iter().find(|(camera, _)| camera == name);
                let of = of.and_then(|(_, targets)| targets.iter().find(|(other, _)| other == target));
                let covariances = of.map(|(_, array)| covariances(&what, array)).transpose()?;
                let poses = poses(&what, &Some(array))?;
                for (index, (sample, pose)) in recording.samples.iter_mut().zip(poses).enumerate() {
                    let Some(pose) = pose else { continue };
                    let covariance = covariances.as_ref().and_then(|all| all[index]);
                    sample.targets.push(TargetDetection { camera, target: target.clone(), pose, covariance });
                }
            }
        }
        Ok(())
    }
}

fn first(array: &Floats<'_>) -> usize {
    array.as_array().shape().first().copied().unwrap_or(0)
}

/// The numbers of a row; `None` where all are NaN.
fn measured(row: ArrayView1<'_, f64>) -> Option<Vec<f64>> {
    (row.is_empty() || row.iter().any(|number| !number.is_nan())).then(|| row.to_vec())
}

fn poses<'py>(what: &str, array: &Option<impl std::borrow::Borrow<Floats<'py>>>) -> PyResult<Vec<Option<Pose>>> {
    let Some(array) = array else { return Ok(Vec::new()) };
    let view = fixed::<Ix3>(what, array.borrow().as_array(), "(samples, 4, 4)")?;
    let entries = view.outer_iter().enumerate();
    entries.map(|(index, matrix)| pose_or_none(&format!("{what}, sample {index}"), matrix.into_dyn())).collect()
}

fn covariances(what: &str, array: &Floats<'_>) -> PyResult<Vec<Option<Matrix6<f64>>>> {
    let view = fixed::<Ix3>(what, array.as_array(), "(samples, 6, 6)")?;
    if view.shape()[1..] != [6, 6] {
        return Err(unusable(format!("{what}: covariances of shape {:?}, and (samples, 6, 6) would do", view.shape())));
    }
    let one = |(index, matrix): (usize, numpy::ndarray::ArrayView2<'_, f64>)| {
        if matrix.iter().all(|number| number.is_nan()) {
            return Ok(None);
        }
        let covariance = Matrix6::from_fn(|i, j| matrix[[i, j]]);
        let is_symmetric = (covariance - covariance.transpose()).amax() <= 1e-9 * covariance.amax();
        if !is_symmetric || covariance.cholesky().is_none() {
            return Err(unusable(format!("{what}, sample {index}: a covariance is symmetric and positive definite")));
        }
        Ok(Some(covariance))
    };
    view.outer_iter().enumerate().map(one).collect()
}

/// The index of a camera, which is added where nothing was said of it.
fn camera_index(recording: &mut Recording, name: &str) -> u32 {
    let known = recording.cameras.iter().position(|camera| camera.name == name);
    let index = known.unwrap_or_else(|| {
        recording.cameras.push(RecordedCamera { name: name.to_owned(), ..RecordedCamera::default() });
        recording.cameras.len() - 1
    });
    index as u32
}

/// Calls `add` for every detection that is not NaN.
fn each<const N: usize>(
    features: &[String],
    what: &str,
    camera: &str,
    array: &Floats<'_>,
    samples: &mut [Sample],
    mut add: impl FnMut(&mut Sample, u32, [f64; N]),
) -> PyResult<()> {
    let what = format!("{what} of `{camera}`");
    let expected = format!("(samples, {}, {N})", features.len());
    let view = fixed::<Ix3>(&what, array.as_array(), &expected)?;
    if view.shape()[1..] != [features.len(), N] {
        return Err(unusable(format!("{what}: shape {:?}, and {expected} would do", view.shape())));
    }
    for (sample, rows) in samples.iter_mut().zip(view.axis_iter(Axis(0))) {
        for (feature, row) in rows.outer_iter().enumerate() {
            if row.iter().any(|number| !number.is_nan()) {
                add(sample, feature as u32, std::array::from_fn(|k| row[k]));
            }
        }
    }
    Ok(())
}

/// A camera by its name: a dictionary of what is known of it, or the path of a calibration file.
pub fn read_camera(name: &Bound<'_, PyAny>, known: &Bound<'_, PyAny>) -> PyResult<RecordedCamera> {
    let name: String = name.extract()?;
    let Ok(known) = known.cast::<PyDict>() else {
        return RecordedCamera::read(&name, &known.extract::<PathBuf>()?).map_err(raise);
    };
    let mut camera = RecordedCamera { name, ..RecordedCamera::default() };
    for (key, value) in known {
        let key: String = key.extract()?;
        match key.as_str() {
            "size" => camera.size = value.extract::<Option<[u32; 2]>>()?,
            "model" => {
                let model: String = value.extract()?;
                camera.model = Some(CameraModel::from_name(&model).ok_or_else(|| {
                    let known = CameraModel::ALL.iter().map(|model| model.name()).collect::<Vec<_>>().join(", ");
                    unusable(format!("camera `{}`: unknown model `{model}` (known: {known})", camera.name))
                })?);
            }
            "fx" => camera.fx = value.extract()?,
            "fy" => camera.fy = value.extract()?,
            "cx" => camera.cx = value.extract()?,
            "cy" => camera.cy = value.extract()?,
            "distortion" => camera.distortion = value.extract::<Option<Vec<f64>>>()?.filter(|list| !list.is_empty()),
            _ => {
                let name = &camera.name;
                return Err(unusable(format!(
                    "camera `{name}`: unknown key `{key}` (known: size, model, fx, fy, cx, cy, distortion)"
                )));
            }
        }
    }
    Ok(camera)
}
