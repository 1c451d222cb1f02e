//! One step towards goals, under limits.
use super::held_back::{Active, words_of};
use super::limits::{Limit, those_of};
use super::tasks::Task;
use crate::arrays::{Floats, NewArray, array, list, vector};
use crate::errors::{raise, unusable};
use crate::rig::AnyRig;
use crate::sight::Layout;
use handeye::rig;
use handeye::servo::{self, Arm, Configuration};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use std::sync::Arc;

/// A task and how strictly it comes before others.
#[pyclass(module = "handeye.servo", frozen)]
pub struct Goal {
    task: Py<Task>,
    priority: usize,
    share: f64,
}

#[pymethods]
impl Goal {
    /// priority: 0 comes first; a goal moves only in what those of smaller numbers leave open, and of one number goals share by their
    /// standard deviations. share: of the error that a step shall take away, in (0, 1]; a loop whose errors shall fall by the rate r [1/s]
    /// takes 1 - exp(-r dt).
    #[new]
    #[pyo3(signature = (task, *, priority = 0, share = 1.0))]
    fn new(task: Py<Task>, priority: usize, share: f64) -> PyResult<Self> {
        if share > 0.0 && share <= 1.0 { Ok(Goal { task, priority, share }) } else { Err(unusable("share: in (0, 1]")) }
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.task)
    }
}

/// Finds motions of a complete rig that lead towards goals under limits, one step at a time.
///
/// Joint limits of the rig (range, speed, acceleration) are hard; every other limit gives way only where it must, and the step says
/// which, and how far.
#[pyclass(module = "handeye.servo")]
pub struct Stepper {
    inner: servo::Stepper,
    rig: Arc<rig::Rig>,
    arm: Arm,
    at: Configuration,
    joints: Vec<f64>,
    /// The motion of the step before, over its duration [rad/s or m/s].
    velocity: Vec<f64>,
}

#[pymethods]
impl Stepper {
    /// damping: share of the squared errors by which steps are damped, (1 rad or 1 m)⁻²; 0 takes whole Gauss-Newton steps.
    #[new]
    #[pyo3(signature = (rig, *, damping = 1e-3))]
    fn new(rig: AnyRig<'_>, damping: f64) -> PyResult<Self> {
        let arm = Arm::new(&rig.inner).map_err(raise)?;
        let velocity = vec![0.0; arm.joints()];
        let (inner, rig) = (servo::Stepper::new(damping), Arc::new(rig.inner.clone()));
        Ok(Stepper { inner, rig, arm, at: Configuration::default(), joints: Vec::new(), velocity })
    }

    /// The motion of the next ``dt`` seconds that leads best towards the goals, from joints where the arm is now.
    ///
    /// joints: readings, shape (n_joints,) [rad or m]. goals: a ``Goal`` or a ``Task`` each. velocity: how fast the joints move now,
    /// (n_joints,) [rad/s or m/s]; left out, that of the last step's motion, 0 at first. The motion is finite and inside the joints'
    /// bounds.
    #[pyo3(signature = (joints, goals, *, dt, limits = None, velocity = None))]
    fn step(
        &mut self,
        joints: &Bound<'_, PyAny>,
        goals: Vec<Bound<'_, PyAny>>,
        dt: f64,
        limits: Option<Vec<Bound<'_, Limit>>>,
        velocity: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Step> {
        let (n, layout) = (self.arm.joints(), Layout::of(&self.rig));
        read("joints", joints, n, &mut self.joints)?;
        if let Some(velocity) = velocity {
            read("velocity", velocity, n, &mut self.velocity)?;
        }
        self.arm.configure(&self.joints, &mut self.at);
        self.at.velocity.clone_from(&self.velocity);
        let mut borrowed: Vec<(PyRef<'_, Task>, usize, f64)> = Vec::with_capacity(goals.len());
        for goal in &goals {
            borrowed.push(match goal.cast::<Goal>() {
                Ok(goal) => {
                    let goal = goal.get();
                    (goal.task.bind(joints.py()).try_borrow()?, goal.priority, goal.share)
                }
                Err(_) => (goal.cast::<Task>()?.try_borrow()?, 0, 1.0),
            });
            borrowed.last().map_or(Ok(()), |(task, ..)| task.fits(&layout, n))?;
        }
        let goals: Vec<servo::Goal<'_>> = borrowed
            .iter()
            .map(|(task, priority, share)| servo::Goal { task: &task.inner, priority: *priority, share: *share })
            .collect();
        let limits = those_of(limits.as_deref(), &layout, n)?;
        let limits: Vec<&dyn servo::Limit> = limits.into_iter().map(|limit| limit as &dyn servo::Limit).collect();
        let step = self.inner.step(&self.arm, &self.at, &goals, &limits, dt).clone();
        drop(goals);
        // All of them are taken, so that none is raised by a later step.
        let raised: Vec<PyErr> = borrowed.iter().filter_map(|(task, ..)| task.raised()).collect();
        if let Some(first) = raised.into_iter().next() {
            return Err(first);
        }
        self.velocity.clear();
        self.velocity.extend(step.motion.iter().map(|motion| if dt > 0.0 { motion / dt } else { 0.0 }));
        Ok(Step { inner: step, rig: self.rig.clone() })
    }
}

/// Numbers of an array where they are, or of whatever numpy makes one from.
pub fn read(what: &str, array: &Bound<'_, PyAny>, n: usize, numbers: &mut Vec<f64>) -> PyResult<()> {
    if let Ok(array) = array.cast::<PyArray1<f64>>()
        && array.len() == n
        && array.is_contiguous()
    {
        *numbers = array.to_vec()?;
        return Ok(());
    }
    *numbers = list(what, &array.extract::<Floats<'_>>()?, n)?;
    Ok(())
}

/// A motion, and what it is worth.
#[pyclass(module = "handeye.servo", frozen)]
pub struct Step {
    inner: servo::Step,
    rig: Arc<rig::Rig>,
}

#[pymethods]
impl Step {
    /// Motion of every joint [rad or m], shape (n_joints,): finite, and inside its bounds.
    #[getter]
    fn motion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.inner.motion)
    }

    /// Of every priority in turn, the root of the sum of the squared errors over their standard deviations: now, and as predicted; shape
    /// (priorities, 2).
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        let errors = &self.inner.errors;
        array(py, &[errors.len(), 2], errors.as_flattened().to_vec())
    }

    /// What holds the motion back.
    #[getter]
    fn active(&self) -> Vec<Active> {
        Active::all(&self.inner.active, &self.rig)
    }

    /// Where a limit gave way: constraints that cannot all hold, though without any one of them the others can, in words.
    #[getter]
    fn conflict(&self) -> Vec<String> {
        words_of(&self.inner.conflict, &self.rig)
    }

    /// True where numbers were not finite or the step broke down: hold the robot then.
    #[getter]
    fn failed(&self) -> bool {
        self.inner.failed
    }

    fn __repr__(&self) -> String {
        let servo::Step { motion, active, failed, .. } = &self.inner;
        let failed = if *failed { ", FAILED" } else { "" };
        format!("<handeye.servo.Step {motion:.5?}, {} constraints active{failed}>", active.len())
    }
}
