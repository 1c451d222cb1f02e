//! What can be learned, by parameter path, and how it is learned.
use super::Rig;
use crate::arrays::{Floats, array, homogeneous, pose};
use crate::errors::{raise, unusable};
use handeye::rig::{Model, Parameter, PoseNoise, Value};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

impl Rig {
    fn parameter(&self, path: &str) -> PyResult<Parameter> {
        self.inner.parameter(path).map_err(|error| PyKeyError::new_err(error.to_string()))
    }
}

#[pymethods]
impl Rig {
    /// Paths of everything that can be learned, in the file's order.
    fn parameters(&self) -> Vec<String> {
        self.inner.parameters().iter().map(|parameter| parameter.path(&self.inner)).collect()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let parameter = self.parameter(path)?;
        Ok(match self.inner.value(&parameter) {
            None => None,
            Some(Value::Number(number)) => Some(number.into_pyobject(py)?.into_any()),
            Some(Value::Numbers(numbers)) => Some(array(py, &[numbers.len()], numbers).into_any()),
            Some(Value::Pose(pose)) => Some(homogeneous(py, &pose).into_any()),
        })
    }

    fn __setitem__(&mut self, path: &str, value: Option<Floats<'_>>) -> PyResult<()> {
        let parameter = self.parameter(path)?;
        let value = match value {
            None => None,
            Some(floats) => {
                let view = floats.as_array();
                let is_pose =
                    matches!(parameter, Parameter::Base | Parameter::CameraPose(_) | Parameter::TargetPose(_));
                Some(match view.ndim() {
                    _ if is_pose => Value::Pose(pose(path, view)?),
                    0 => Value::Number(view[[]]),
                    1 => Value::Numbers(view.iter().copied().collect()),
                    _ => return Err(unusable(format!("{path}: shape {:?} is that of no value", view.shape()))),
                })
            }
        };
        self.inner.set_value(&parameter, value).map_err(raise)
    }

    fn __delitem__(&mut self, path: &str) -> PyResult<()> {
        let parameter = self.parameter(path)?;
        self.inner.set_value(&parameter, None).map_err(raise)
    }

    fn __contains__(&self, path: &str) -> bool {
        self.inner.parameter(path).is_ok_and(|parameter| self.inner.has_value(&parameter))
    }

    /// True where every value is given, so that pixels can be predicted.
    #[getter]
    fn is_complete(&self) -> bool {
        Model::new(&self.inner).is_ok()
    }

    /// Paths of parameters that are held at their values when the rig is learned; ``*`` stands for any part of a name.
    #[getter]
    fn fixed(&self) -> Vec<String> {
        self.inner.estimate.fixed.clone()
    }

    #[setter]
    fn set_fixed(&mut self, paths: Vec<String>) -> PyResult<()> {
        self.change(|rig| rig.estimate.fixed = paths)
    }

    /// Standard deviations of Gaussian priors around values, by parameter path [unit of the value]; ``*`` stands for any part of a name.
    #[getter]
    fn prior(&self) -> BTreeMap<String, f64> {
        self.inner.estimate.prior.clone()
    }

    #[setter]
    fn set_prior(&mut self, prior: BTreeMap<String, f64>) -> PyResult<()> {
        self.change(|rig| rig.estimate.prior = prior)
    }

    /// Standard deviations of what is measured and commanded, as the table ``[noise]`` of rig files has them: ``pixels`` [px], ``points``
    /// [m], ``joints`` and ``joint_action`` [rad or m], and as pairs (translation [m], rotation [rad]) ``pose``, ``pose_action`` and
    /// ``target`` (``None``: estimated). Changed by ``set_noise``.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let noise = &self.inner.noise;
        let pair = |noise: PoseNoise| (noise.xyz, noise.rot);
        let dict = PyDict::new(py);
        dict.set_item("pixels", noise.pixels)?;
        dict.set_item("points", noise.points)?;
        dict.set_item("joints", noise.joints)?;
        dict.set_item("pose", pair(noise.pose))?;
        dict.set_item("target", noise.target.map(pair))?;
        dict.set_item("joint_action", noise.joint_action)?;
        dict.set_item("pose_action", pair(noise.pose_action))?;
        Ok(dict)
    }

    /// Changes standard deviations of what is measured and commanded; what is not named stays. Units: see ``noise``.
    #[pyo3(signature = (*, pixels=None, points=None, joints=None, pose=None, target=None, joint_action=None, pose_action=None))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per noise")]
    fn set_noise(
        &mut self,
        pixels: Option<f64>,
        points: Option<f64>,
        joints: Option<f64>,
        pose: Option<(f64, f64)>,
        target: Option<(f64, f64)>,
        joint_action: Option<f64>,
        pose_action: Option<(f64, f64)>,
    ) -> PyResult<()> {
        let both = |(xyz, rot): (f64, f64)| PoseNoise { xyz, rot };
        self.change(|rig| {
            let noise = &mut rig.noise;
            noise.pixels = pixels.unwrap_or(noise.pixels);
            noise.points = points.unwrap_or(noise.points);
            noise.joints = joints.unwrap_or(noise.joints);
            noise.pose = pose.map_or(noise.pose, both);
            noise.target = target.map(both).or(noise.target);
            noise.joint_action = joint_action.unwrap_or(noise.joint_action);
            noise.pose_action = pose_action.map_or(noise.pose_action, both);
        })
    }

    /// Standard deviations of what was learned, by parameter path: poses as (3 translations [m], 3 of the rotation vector [rad]), points
    /// as three, numbers as one; shape (6,), (3,) or (1,). Empty where the rig was not learned.
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (path, numbers) in self.inner.fit.iter().flat_map(|fit| &fit.sd) {
            dict.set_item(path, array(py, &[numbers.len()], numbers.clone()))?;
        }
        Ok(dict)
    }
}
