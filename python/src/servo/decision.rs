//! What controllers say: decisions and commands.
use super::held_back::{Active, words_of};
use crate::arrays::{array, homogeneous, vector};
use handeye::rig;
use handeye::servo::{self, Command, Takes};
use pyo3::prelude::*;
use std::sync::Arc;

/// A command, and what holds it back.
#[pyclass(module = "handeye.servo", frozen)]
pub struct Decision {
    pub inner: servo::Decision,
    pub rig: Arc<rig::Rig>,
}

#[pymethods]
impl Decision {
    /// What the robot shall do.
    #[getter]
    fn command(&self) -> MotionCommand {
        MotionCommand { inner: self.inner.command.clone() }
    }

    /// What holds it back.
    #[getter]
    fn active(&self) -> Vec<Active> {
        Active::all(&self.inner.active, &self.rig)
    }

    /// Constraints that cannot all hold, where a limit gave way, in words.
    #[getter]
    fn conflict(&self) -> Vec<String> {
        words_of(&self.inner.conflict, &self.rig)
    }

    /// Features whose trackers are not believed, as indices of camera and feature.
    #[getter]
    fn left_out(&self) -> Vec<(usize, usize)> {
        self.inner.left_out.clone()
    }

    /// True where the motion is to learn from and not to arrive.
    #[getter]
    fn explores(&self) -> bool {
        self.inner.explores
    }

    /// Why the controller gives up, where it does.
    #[getter]
    fn stop(&self) -> Option<Stop> {
        self.inner.stop.as_ref().map(|stop| Stop::new(stop, &self.rig))
    }

    fn __repr__(&self) -> String {
        format!("<handeye.servo.Decision {:?}, {} constraints active>", self.inner.command, self.inner.active.len())
    }
}

/// What a robot is told to do until the next command.
#[pyclass(module = "handeye.servo", frozen)]
pub struct MotionCommand {
    pub inner: Command,
}

#[pymethods]
impl MotionCommand {
    /// ``"hold"``, ``"joints"``, ``"joint-deltas"``, ``"joint-velocities"``, ``"pose-deltas"`` or ``"pose-velocities"``.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.inner {
            Command::Hold => "hold",
            Command::Joints(_) => Takes::Joints.name(),
            Command::JointDelta(_) => Takes::JointDelta.name(),
            Command::JointVelocity(_) => Takes::JointVelocity.name(),
            Command::PoseDelta(_) => Takes::PoseDelta.name(),
            Command::PoseVelocity(_) => Takes::PoseVelocity.name(),
        }
    }

    /// One number per joint [rad or m, or per second]; for poses a motion A of the world, P_next = A P, (4, 4), or a velocity (6,):
    /// angular [rad/s], then linear [m/s]; ``None`` to hold.
    #[getter]
    fn value<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        match &self.inner {
            Command::Hold => None,
            Command::Joints(numbers) | Command::JointDelta(numbers) | Command::JointVelocity(numbers) => {
                Some(vector(py, numbers).into_any())
            }
            Command::PoseDelta(pose) => Some(homogeneous(py, pose).into_any()),
            Command::PoseVelocity(twist) => Some(array(py, &[6], twist.to_vec()).into_any()),
        }
    }

    fn __repr__(&self) -> String {
        format!("<handeye.servo.MotionCommand {:?}>", self.inner)
    }
}

/// Why a loop moves no more.
#[pyclass(module = "handeye.servo", frozen, get_all)]
pub struct Stop {
    /// ``"converged"``, ``"no-better"``, ``"blocked"``, ``"diverged"``, ``"undetermined"``, ``"lost"`` or ``"timed-out"``.
    name: &'static str,
    /// True where the features are as near as they can be brought.
    is_success: bool,
    /// In words.
    words: String,
}

impl Stop {
    pub fn new(stop: &servo::Stop, rig: &rig::Rig) -> Self {
        Stop { name: stop.name(), is_success: stop.is_success(), words: stop.words(rig, &[]) }
    }
}

#[pymethods]
impl Stop {
    fn __str__(&self) -> &str {
        &self.words
    }

    fn __repr__(&self) -> String {
        format!("<handeye.servo.Stop {}>", self.words)
    }
}
