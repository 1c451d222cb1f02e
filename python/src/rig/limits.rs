//! Limits of the joints, one array each.
use super::Rig;
use crate::arrays::{Floats, NewArray, array, list};
use crate::errors::unusable;
use handeye::rig::Limits;
use pyo3::prelude::*;

impl Rig {
    fn limit(&self, of: impl Fn(&Limits) -> Option<f64>, unlimited: f64) -> Vec<f64> {
        self.inner.robot.joints.iter().map(|joint| of(&joint.limits).unwrap_or(unlimited)).collect()
    }

    fn set_limit(
        &mut self,
        what: &str,
        values: &Floats<'_>,
        unlimited: f64,
        of: impl Fn(&mut Limits) -> &mut Option<f64>,
    ) -> PyResult<()> {
        let values = bounds(what, values, self.inner.robot.joints.len(), unlimited)?;
        self.change(|rig| {
            for (joint, value) in rig.robot.joints.iter_mut().zip(&values) {
                *of(&mut joint.limits) = *value;
            }
        })
    }
}

#[pymethods]
impl Rig {
    /// Smallest reading of every joint [rad or m], -inf where unlimited; shape (n_joints,).
    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.lower, f64::NEG_INFINITY))
    }

    #[setter]
    fn set_lower(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("lower", &values, f64::NEG_INFINITY, |limits| &mut limits.lower)
    }

    /// Largest reading of every joint [rad or m], inf where unlimited; shape (n_joints,).
    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.upper, f64::INFINITY))
    }

    #[setter]
    fn set_upper(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("upper", &values, f64::INFINITY, |limits| &mut limits.upper)
    }

    /// Largest speed of every joint [rad/s or m/s], inf where unlimited; shape (n_joints,).
    #[getter]
    fn max_velocity<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.velocity, f64::INFINITY))
    }

    #[setter]
    fn set_max_velocity(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("max_velocity", &values, f64::INFINITY, |limits| &mut limits.velocity)
    }

    /// Largest acceleration of every joint [rad/s² or m/s²], inf where unlimited; shape (n_joints,).
    #[getter]
    fn max_acceleration<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.acceleration, f64::INFINITY))
    }

    #[setter]
    fn set_max_acceleration(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("max_acceleration", &values, f64::INFINITY, |limits| &mut limits.acceleration)
    }
}

/// Bounds of joints, `None` where they are `unlimited`.
pub fn bounds(what: &str, values: &Floats<'_>, n: usize, unlimited: f64) -> PyResult<Vec<Option<f64>>> {
    let of = |value: f64| match value {
        value if value == unlimited => Ok(None),
        value if value.is_finite() => Ok(Some(value)),
        value => Err(unusable(format!("{what}: {value} is no bound; {unlimited} is none at all"))),
    };
    list(what, values, n)?.into_iter().map(of).collect()
}
