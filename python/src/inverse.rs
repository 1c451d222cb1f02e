//! `InverseKinematics`: the pose of the tip to joints.
use crate::arrays::{Floats, list, pose, vector};
use crate::errors::raise;
use crate::rig::AnyRig;
use handeye::infer::{self as library, InverseOptions};
use numpy::PyArray1;
use pyo3::prelude::*;

/// Inverse kinematics of an arm of any number of joints, inside their limits; prepared once. Cameras and features may be unknown.
#[pyclass(module = "handeye")]
pub struct InverseKinematics {
    inner: library::InverseKinematics,
    n_joints: usize,
}

#[pymethods]
impl InverseKinematics {
    /// xyz [m], rot [rad]: how near counts as reached. metres_per_radian: the distance that weighs as much as a radian where a pose is out
    /// of reach. starts: tried before a pose counts as out of reach. seed: the same seed gives the same solution.
    #[new]
    #[pyo3(signature = (rig, *, xyz = 1e-7, rot = 1e-7, metres_per_radian = 0.3, starts = 100, seed = 1))]
    fn new(rig: AnyRig<'_>, xyz: f64, rot: f64, metres_per_radian: f64, starts: usize, seed: u64) -> PyResult<Self> {
        let options = InverseOptions { xyz, rot, metres_per_radian, starts, seed };
        let inner = library::InverseKinematics::new(&rig.inner, options).map_err(raise)?;
        Ok(InverseKinematics { inner, n_joints: rig.inner.robot.joints.len() })
    }

    /// Joints that bring the tip to a pose, world_from_tip (4, 4): the first that reach it, or else the closest that were found.
    ///
    /// near: where the search begins, shape (n_joints,).
    #[pyo3(signature = (world_from_tip, near = None))]
    fn solve(&mut self, py: Python<'_>, world_from_tip: Floats<'_>, near: Option<Floats<'_>>) -> PyResult<Reached> {
        let (pose, near) = self.read(&world_from_tip, near.as_ref())?;
        Ok(py.detach(|| self.inner.solve(&pose, &near)).into())
    }

    /// All branches that reach a pose, nearest to ``near`` first; empty where it is out of reach.
    #[pyo3(signature = (world_from_tip, near = None))]
    fn branches(
        &mut self,
        py: Python<'_>,
        world_from_tip: Floats<'_>,
        near: Option<Floats<'_>>,
    ) -> PyResult<Vec<Reached>> {
        let (pose, near) = self.read(&world_from_tip, near.as_ref())?;
        Ok(py.detach(|| self.inner.branches(&pose, &near)).into_iter().map(Reached::from).collect())
    }
}

impl InverseKinematics {
    fn read(&self, target: &Floats<'_>, near: Option<&Floats<'_>>) -> PyResult<(handeye::solvers::Pose, Vec<f64>)> {
        let near = near.map_or_else(|| Ok(Vec::new()), |near| list("near", near, self.n_joints))?;
        Ok((pose("world_from_tip", target.as_array())?, near))
    }
}

/// Joints for a pose of the tip.
#[pyclass(module = "handeye", frozen)]
pub struct Reached {
    inner: library::Reached,
}

impl From<library::Reached> for Reached {
    fn from(inner: library::Reached) -> Self {
        Reached { inner }
    }
}

#[pymethods]
impl Reached {
    /// One reading per joint, inside its limits [rad or m], shape (n_joints,).
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.inner.joints)
    }

    /// Distance of the tip from the pose [m].
    #[getter]
    fn xyz(&self) -> f64 {
        self.inner.xyz
    }

    /// Angle of the tip to the pose [rad].
    #[getter]
    fn rot(&self) -> f64 {
        self.inner.rot
    }

    /// False where the pose is out of reach: then these are the closest joints that were found.
    #[getter]
    fn reached(&self) -> bool {
        self.inner.reached
    }

    fn __repr__(&self) -> String {
        let library::Reached { joints, xyz, rot, reached, .. } = &self.inner;
        let word = if *reached { "reached" } else { "out of reach" };
        format!("<handeye.Reached joints {joints:.4?}, {word}: {xyz:.1e} m, {rot:.1e} rad off>")
    }
}
