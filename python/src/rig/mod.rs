//! The class `Rig`, its file and its names; what else it can do stands in a file each.
mod limits;
mod numbers;
mod prediction;
mod views;

pub use limits::bounds;

use crate::errors::{raise, unusable};
use handeye::Error;
use handeye::chain::JointKind;
use handeye::rig::{self, Model, catalog};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::ops::Deref;
use std::path::PathBuf;

/// A robot arm, the cameras that watch it and the features that they track: a rig file in memory.
///
/// What is unknown has no value, and is learned by ``handeye.calibrate``. Numbers are looked at and changed by their parameter path, as
/// in rig files and reports: ``rig["cameras.left.fx"]`` [px], ``rig["robot.joints.elbow.d"]`` [m], ``rig["features.f0.xyz"]`` [m, shape
/// (3,)], ``rig["cameras.left.pose"]`` (4 x 4, parent_from_camera); ``None`` where unknown; ``del rig[path]`` forgets a value.
/// ``Rig()`` is empty: everything is unknown.
///
/// Units: metres, radians, seconds, pixels. Poses are homogeneous matrices that map the child's coordinates into its parent's.
#[pyclass(module = "handeye", eq)]
#[derive(Clone, Default)]
pub struct Rig {
    pub inner: rig::Rig,
    /// The text of the file that it was read from, whose comments are kept.
    pub text: Option<String>,
}

/// Two rigs are the same where they say the same, whatever comments their files have.
impl PartialEq for Rig {
    fn eq(&self, other: &Self) -> bool {
        self.inner == other.inner
    }
}

impl Rig {
    /// The model of a complete rig.
    pub fn model(&self) -> PyResult<Model> {
        Model::new(&self.inner).map_err(raise)
    }

    /// Takes a change over where a rig file could say it.
    fn change(&mut self, change: impl FnOnce(&mut rig::Rig)) -> PyResult<()> {
        let mut changed = self.inner.clone();
        change(&mut changed);
        match rig::Rig::parse(&changed.to_toml(), "rig") {
            Ok(_) => self.inner = changed,
            // The place is one in a text that nobody sees.
            Err(Error::Malformed { problem, .. }) => return Err(unusable(problem)),
            Err(error) => return Err(raise(error)),
        }
        Ok(())
    }
}

/// A rig, or the name or path by which [`Rig::load`] finds one.
pub enum AnyRig<'py> {
    Loaded(PyRef<'py, Rig>),
    Named(Box<Rig>),
}

impl Deref for AnyRig<'_> {
    type Target = Rig;

    fn deref(&self) -> &Rig {
        match self {
            AnyRig::Loaded(rig) => rig,
            AnyRig::Named(rig) => rig,
        }
    }
}

impl<'py> FromPyObject<'_, 'py> for AnyRig<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(rig) = object.cast::<Rig>() {
            return Ok(AnyRig::Loaded(rig.try_borrow()?));
        }
        let path = object.extract::<PathBuf>();
        let path =
            path.map_err(|_| PyTypeError::new_err("a rig is a handeye.Rig, a path or the name of a shipped one"))?;
        Rig::load(path).map(|rig| AnyRig::Named(Box::new(rig)))
    }
}

#[pymethods]
impl Rig {
    #[new]
    fn new() -> Self {
        Rig::default()
    }

    /// Reads a rig file (TOML), or takes the shipped rig of that name where there is no such file: see ``handeye.shipped_rigs()``.
    ///
    /// Raises ``UnusableInput`` with file, line and column for whatever is wrong inside.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let name = path.display().to_string();
        if !path.exists()
            && let Some((_, text)) = catalog::ALL.iter().find(|(known, _)| *known == name)
        {
            return Ok(Rig { inner: catalog::rig(&name).map_err(raise)?, text: Some((*text).to_owned()) });
        }
        let (inner, text) = rig::Rig::read_with_text(&path).map_err(raise)?;
        Ok(Rig { inner, text: Some(text) })
    }

    /// Reads the text of a rig file, which messages call ``file_name``; files that it names are looked for beside that.
    #[staticmethod]
    #[pyo3(signature = (text, file_name = "rig.toml"))]
    fn from_string(text: &str, file_name: &str) -> PyResult<Self> {
        let inner = rig::Rig::parse(text, file_name).map_err(raise)?;
        Ok(Rig { inner, text: Some(text.to_owned()) })
    }

    /// Writes a rig file, whole or not at all. Comments and order of the file that it was read from survive.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        self.inner.write(&path, self.text.as_deref()).map_err(raise)
    }

    /// The text of a rig file that reads back as this rig, with the comments of the one that it was read from.
    fn to_toml(&self) -> PyResult<String> {
        match &self.text {
            Some(text) => self.inner.update_toml(text).map_err(raise),
            None => Ok(self.inner.to_toml()),
        }
    }

    /// A copy that changes by itself.
    fn copy(&self) -> Self {
        self.clone()
    }

    fn __copy__(&self) -> Self {
        self.clone()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.clone()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((py.get_type::<Rig>().getattr("from_string")?, (self.to_toml()?,)))
    }

    fn __repr__(&self) -> String {
        let rig = &self.inner;
        let name = rig.name.as_ref().map_or_else(String::new, |name| format!("{name:?}: "));
        let (joints, cameras, features) = (rig.robot.joints.len(), rig.cameras.len(), rig.features.len());
        format!("<handeye.Rig {name}{joints} joints, {cameras} cameras, {features} features>")
    }

    /// What its author calls it.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.inner.name.as_deref()
    }

    #[setter]
    fn set_name(&mut self, name: Option<String>) {
        self.inner.name = name;
    }

    /// How many joints it has.
    #[getter]
    fn n_joints(&self) -> usize {
        self.inner.robot.joints.len()
    }

    /// Names of the joints, from base to tip.
    #[getter]
    fn joint_names(&self) -> Vec<&str> {
        self.inner.robot.joints.iter().map(|joint| joint.name.as_str()).collect()
    }

    /// ``"revolute"`` or ``"prismatic"`` for every joint.
    #[getter]
    fn joint_types(&self) -> Vec<&'static str> {
        let name = |kind| match kind {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        self.inner.robot.joints.iter().map(|joint| name(joint.kind)).collect()
    }

    /// Names of the cameras, in the file's order.
    #[getter]
    fn camera_names(&self) -> Vec<&str> {
        self.inner.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    /// Names of the features, in the file's order: that of the arrays of ``predict``.
    #[getter]
    fn feature_names(&self) -> Vec<&str> {
        self.inner.features.iter().map(|feature| feature.name.as_str()).collect()
    }

    /// Names of the targets (tags and boards that are seen as whole poses), in the file's order.
    #[getter]
    fn target_names(&self) -> Vec<&str> {
        self.inner.targets.iter().map(|target| target.name.as_str()).collect()
    }
}

/// Names of the rigs that come with handeye, for ``Rig.load``.
#[pyfunction]
pub fn shipped_rigs() -> Vec<&'static str> {
    catalog::ALL.iter().map(|(name, _)| *name).collect()
}
