//! Tasks: where a motion shall lead.
use crate::arrays::{Floats, fixed, list, pose, three};
use crate::errors::unusable;
use crate::rig::AnyRig;
use crate::sight::Layout;
use handeye::servo::tasks::{self, TipMotion};
use handeye::servo::{Arm, Configuration, TaskRows};
use numpy::ndarray::Ix2;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// Where a motion shall lead: the base class of all tasks.
#[pyclass(module = "handeye.servo", subclass)]
pub struct Task {
    pub inner: Kind,
}

pub enum Kind {
    ImagePoints(tasks::ImagePoints),
    TipPose(tasks::TipPose),
    JointTarget(tasks::JointTarget),
    LookAt(tasks::LookAt),
    Manipulability(tasks::Manipulability),
    Function(Function),
}

impl handeye::servo::Task for Kind {
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        match self {
            Kind::ImagePoints(task) => task.rows(arm, at, rows),
            Kind::TipPose(task) => task.rows(arm, at, rows),
            Kind::JointTarget(task) => task.rows(arm, at, rows),
            Kind::LookAt(task) => task.rows(arm, at, rows),
            Kind::Manipulability(task) => task.rows(arm, at, rows),
            Kind::Function(function) => function.rows(at, rows),
        }
    }
}

#[pymethods]
impl Task {
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        if let Kind::Function(function) = &self.inner { visit.call(&function.function) } else { Ok(()) }
    }

    fn __clear__(&mut self) {
        if let Kind::Function(function) = &mut self.inner {
            function.function = None;
        }
    }
}

fn new<T: pyo3::PyClass<BaseType = Task>>(task: T, inner: Kind) -> PyClassInitializer<T> {
    PyClassInitializer::from(Task { inner }).add_subclass(task)
}

/// Features to pixels, in any number of cameras.
#[pyclass(module = "handeye.servo", extends = Task)]
pub struct ImagePoints {
    layout: Layout,
}

#[pymethods]
impl ImagePoints {
    /// rig: whose cameras and features these are. targets: camera -> (n_features, 2) [px], NaN for features that may be anywhere. seen:
    /// where features are seen now, likewise; of those not among them, the rig's prediction is taken. sd: standard deviation of a pixel
    /// coordinate [px], the weight beside other tasks.
    #[new]
    #[pyo3(signature = (rig, targets, *, seen = None, sd = 1.0))]
    fn new(
        rig: AnyRig<'_>,
        targets: &Bound<'_, PyDict>,
        seen: Option<&Bound<'_, PyDict>>,
        sd: f64,
    ) -> PyResult<PyClassInitializer<Self>> {
        let layout = Layout::of(&rig.inner);
        let mut task = tasks::ImagePoints { sd: positive("sd", sd)?, ..tasks::ImagePoints::default() };
        layout.pixels(targets, &mut task.targets)?;
        if let Some(seen) = seen {
            layout.pixels(seen, &mut task.seen)?;
        }
        Ok(new(ImagePoints { layout }, Kind::ImagePoints(task)))
    }

    /// Sets where features are seen now: camera -> (n_features, 2) [px], NaN where not seen.
    fn see(mut slf: PyRefMut<'_, Self>, seen: &Bound<'_, PyDict>) -> PyResult<()> {
        let layout = slf.layout.clone();
        if let Kind::ImagePoints(task) = &mut slf.as_super().inner {
            layout.pixels(seen, &mut task.seen)?;
        }
        Ok(())
    }

    /// Sets where features shall be: camera -> (n_features, 2) [px], NaN for those that may be anywhere.
    fn aim(mut slf: PyRefMut<'_, Self>, targets: &Bound<'_, PyDict>) -> PyResult<()> {
        let layout = slf.layout.clone();
        if let Kind::ImagePoints(task) = &mut slf.as_super().inner {
            layout.pixels(targets, &mut task.targets)?;
        }
        Ok(())
    }
}

/// The tip to a pose: its position, its orientation, or both.
#[pyclass(module = "handeye.servo", extends = Task)]
pub struct TipPose;

#[pymethods]
impl TipPose {
    /// target: world_from_tip, (4, 4). xyz_sd [m], rot_sd [rad]: standard deviations of each coordinate of the position and about each
    /// axis; infinite where it may be any.
    #[new]
    #[pyo3(signature = (target, *, xyz_sd = 1e-3, rot_sd = 5e-3))]
    fn new(target: Floats<'_>, xyz_sd: f64, rot_sd: f64) -> PyResult<PyClassInitializer<Self>> {
        let target = pose("target", target.as_array())?;
        let (xyz_sd, rot_sd) = (positive("xyz_sd", xyz_sd)?, positive("rot_sd", rot_sd)?);
        Ok(new(TipPose, Kind::TipPose(tasks::TipPose { target, xyz_sd, rot_sd })))
    }

    /// Sets the pose aimed at, world_from_tip, (4, 4).
    fn aim(mut slf: PyRefMut<'_, Self>, target: Floats<'_>) -> PyResult<()> {
        let target = pose("target", target.as_array())?;
        if let Kind::TipPose(task) = &mut slf.as_super().inner {
            task.target = target;
        }
        Ok(())
    }
}

/// Joints to readings; as a goal of low priority a posture that is kept as far as other goals allow.
#[pyclass(module = "handeye.servo", extends = Task)]
pub struct JointTarget;

#[pymethods]
impl JointTarget {
    /// joints: shape (n_joints,) [rad or m]. sd: standard deviation of all, or of each; infinite where a joint may be anywhere.
    #[new]
    #[pyo3(signature = (joints, *, sd = None))]
    fn new(joints: Floats<'_>, sd: Option<Floats<'_>>) -> PyResult<PyClassInitializer<Self>> {
        let joints = list("joints", &joints, joints.as_array().len())?;
        let mut task = tasks::JointTarget::new(joints, 1e-2);
        if let Some(sd) = sd {
            let n = task.joints.len();
            let view = sd.as_array();
            task.sd = if view.ndim() == 0 { vec![view[[]]; n] } else { list("sd", &sd, n)? };
            for sd in &task.sd {
                positive("sd", *sd)?;
            }
        }
        Ok(new(JointTarget, Kind::JointTarget(task)))
    }

    /// Sets the readings aimed at, shape (n_joints,) [rad or m].
    fn aim(mut slf: PyRefMut<'_, Self>, joints: Floats<'_>) -> PyResult<()> {
        if let Kind::JointTarget(task) = &mut slf.as_super().inner {
            task.joints = list("joints", &joints, task.sd.len())?;
        }
        Ok(())
    }
}

/// Turns an axis of the tip towards a point of the world.
#[pyclass(module = "handeye.servo", extends = Task)]
pub struct LookAt;

#[pymethods]
impl LookAt {
    /// point: in the world, (3,) [m]. axis: in the tip's frame, (3,). sd: standard deviation of the angle about each axis [rad].
    #[new]
    #[pyo3(signature = (point, axis, *, sd = 5e-3))]
    fn new(point: Floats<'_>, axis: Floats<'_>, sd: f64) -> PyResult<PyClassInitializer<Self>> {
        let (point, axis) = (three("point", &point)?, three("axis", &axis)?);
        Ok(new(LookAt, Kind::LookAt(tasks::LookAt { point, axis, sd: positive("sd", sd)? })))
    }
}

/// Away from singularities: raises Yoshikawa's measure w where it is below what is wanted.
#[pyclass(module = "handeye.servo", extends = Task)]
pub struct Manipulability;

#[pymethods]
impl Manipulability {
    /// wanted: the measure from which on no more is wanted. of: ``"pose"`` or ``"position"``, the motions of the tip that count. length:
    /// translation that counts as much as a turn by 1 rad [m]. sd: standard deviation of ln w.
    #[new]
    #[pyo3(signature = (wanted, *, of = "pose", length = 0.3, sd = 0.1))]
    fn new(wanted: f64, of: &str, length: f64, sd: f64) -> PyResult<PyClassInitializer<Self>> {
        let of = match of {
            "pose" => TipMotion::Pose,
            "position" => TipMotion::Position,
            other => return Err(unusable(format!("of: `{other}` is neither pose nor position"))),
        };
        let (length, wanted, sd) = (positive("length", length)?, positive("wanted", wanted)?, positive("sd", sd)?);
        Ok(new(Manipulability, Kind::Manipulability(tasks::Manipulability { of, length, wanted, sd })))
    }
}

/// A task of one's own, as a Python function: for prototypes.
///
/// ``function(joints)`` returns ``(change, slopes)``: the change that is wanted of something, shape (rows,), and how it changes with the
/// joints, shape (rows, n_joints). What it raises, the step raises.
#[pyclass(module = "handeye.servo", extends = Task)]
pub struct FunctionTask;

#[pymethods]
impl FunctionTask {
    /// sd: standard deviation of every row, in the unit of the change.
    #[new]
    #[pyo3(signature = (function, *, sd = 1.0))]
    fn new(function: Py<PyAny>, sd: f64) -> PyResult<PyClassInitializer<Self>> {
        let function = Function { function: Some(function), sd: positive("sd", sd)?, raised: Mutex::new(None) };
        Ok(new(FunctionTask, Kind::Function(function)))
    }
}

pub struct Function {
    /// `None` where the object is being thrown away.
    function: Option<Py<PyAny>>,
    sd: f64,
    raised: Mutex<Option<PyErr>>,
}

impl Function {
    fn rows(&self, at: &Configuration, rows: &mut TaskRows) {
        let added = Python::attach(|py| self.add(py, &at.joints, rows));
        if let Err(error) = added {
            self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }

    fn add(&self, py: Python<'_>, joints: &[f64], rows: &mut TaskRows) -> PyResult<()> {
        let Some(function) = &self.function else { return Ok(()) };
        let given = function.call1(py, (crate::arrays::vector(py, joints),))?;
        let (change, slopes): (Floats<'_>, Floats<'_>) = given.extract(py)?;
        let n = joints.len();
        let change = list("change", &change, change.as_array().len())?;
        let slopes = fixed::<Ix2>("slopes", slopes.as_array(), &format!("({}, {n})", change.len()))?;
        if slopes.shape() != [change.len(), n] {
            let found = slopes.shape();
            return Err(unusable(format!("slopes: shape {found:?}, and ({}, {n}) would do", change.len())));
        }
        for (change, slopes) in change.iter().zip(slopes.outer_iter()) {
            rows.push(slopes.iter().copied(), *change, self.sd);
        }
        Ok(())
    }
}

impl Task {
    /// Whether it is a task of an arm with so many joints, before such cameras.
    pub fn fits(&self, layout: &Layout, n_joints: usize) -> PyResult<()> {
        match &self.inner {
            Kind::JointTarget(task) if task.joints.len() != n_joints => {
                let found = task.joints.len();
                Err(unusable(format!("joint target: shape [{found}], and ({n_joints},) would do")))
            }
            Kind::ImagePoints(task) => {
                task.targets.iter().try_for_each(|target| layout.check_has("tasks", target.camera, target.feature))
            }
            _ => Ok(()),
        }
    }

    /// What a function of the task has raised since it was last asked.
    pub fn raised(&self) -> Option<PyErr> {
        match &self.inner {
            Kind::Function(function) => function.raised.lock().unwrap_or_else(PoisonError::into_inner).take(),
            _ => None,
        }
    }
}

/// A standard deviation or length that is above 0.
pub fn positive(what: &str, value: f64) -> PyResult<f64> {
    if value > 0.0 { Ok(value) } else { Err(unusable(format!("{what}: {value}, and it has to be above 0"))) }
}
