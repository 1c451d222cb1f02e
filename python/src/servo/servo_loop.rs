//! The closed loop around a controller.
use super::controllers::{Controller, Shared};
use super::decision::{MotionCommand, Stop};
use super::held_back::{Active, words_of};
use super::limits::{Limit, those_of};
use super::step::read;
use crate::errors::raise;
use crate::sight::Layout;
use handeye::infer::Sighting;
use handeye::rig;
use handeye::servo::{self, LoopSettings, Measurement};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// A closed loop around a controller: the caller measures and moves, the loop says how and until when.
///
/// It holds still on what is stale, missing or not a number, and says why it stops: converged, no better given the noise, blocked by
/// limits, diverged, undetermined, lost, timed out.
#[pyclass(module = "handeye.servo")]
pub struct ServoLoop {
    inner: servo::ServoLoop<Shared>,
    layout: Layout,
    rig: Arc<rig::Rig>,
    seen: Vec<Sighting>,
    joints: Vec<f64>,
}

#[pymethods]
impl ServoLoop {
    /// tolerance_px: error below which features are where they shall be, as the mean of their pixel distances. settled: measurements in a row within it. window:
    /// measurements over which the error has to fall. diverged: times the first error at which the loop has diverged. timeout, watchdog
    /// (age of measurements on which nothing moves), patience (without a useful measurement) [s]. look_then_move: waits for a measurement
    /// from after the last motion before the next. follow: the target moves, and arriving does not end the loop.
    #[new]
    #[pyo3(signature = (controller, *, tolerance_px = 0.5, settled = 2, window = 10, diverged = 3.0, timeout = 60.0, watchdog = 0.5,
        patience = 5.0, look_then_move = true, follow = false))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per setting")]
    fn new(
        controller: &Bound<'_, Controller>,
        tolerance_px: f64,
        settled: usize,
        window: usize,
        diverged: f64,
        timeout: f64,
        watchdog: f64,
        patience: f64,
        look_then_move: bool,
        follow: bool,
    ) -> Self {
        let settings = LoopSettings {
            tolerance_px,
            settled,
            window,
            diverged,
            timeout,
            watchdog,
            patience,
            look_then_move,
            follow,
        };
        let controller = controller.get();
        ServoLoop {
            inner: servo::ServoLoop::new(controller.shared.clone(), settings),
            layout: controller.layout.clone(),
            rig: controller.rig.clone(),
            seen: Vec::new(),
            joints: Vec::new(),
        }
    }

    /// Sets where features shall be seen: camera -> (n_features, 2) [px], NaN for those that may be anywhere. May be called before every
    /// tick for a target that moves; begins anew where the loop had stopped.
    fn aim(&mut self, goal: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut sightings = Vec::new();
        self.layout.pixels(goal, &mut sightings)?;
        self.inner.aim(&sightings);
        Ok(())
    }

    /// What to do for the next ``dt`` seconds, at ``now`` [s] of the clock by which measurements are dated.
    ///
    /// pixels: what was seen at ``time`` [s] (``now`` where left out); points: depth camera -> (n_features, 3) [m], likewise; joints: readings, (n_joints,), where the robot gives any.
    #[expect(clippy::too_many_arguments, reason = "one keyword per measurement")]
    #[pyo3(signature = (now, pixels, joints = None, *, dt, time = None, limits = None, points = None))]
    fn tick(
        &mut self,
        py: Python<'_>,
        now: f64,
        pixels: &Bound<'_, PyDict>,
        joints: Option<&Bound<'_, PyAny>>,
        dt: f64,
        time: Option<f64>,
        limits: Option<Vec<Bound<'_, Limit>>>,
        points: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Tick> {
        let points = self.layout.points(points)?;
        self.layout.pixels(pixels, &mut self.seen)?;
        self.joints.clear();
        if let Some(joints) = joints {
            read("joints", joints, self.rig.robot.joints.len(), &mut self.joints)?;
        }
        let limits = those_of(limits.as_deref(), &self.layout, self.rig.robot.joints.len())?;
        let (servo, joints, seen) = (&mut self.inner, &self.joints, &self.seen);
        let ticked = py.detach(|| {
            let limits: Vec<&dyn handeye::servo::Limit> =
                limits.iter().map(|limit| *limit as &dyn handeye::servo::Limit).collect();
            let measured = Measurement { time: time.unwrap_or(now), joints, seen, points: &points };
            servo.tick(now, &measured, &limits, dt)
        });
        let inner = ticked.map_err(raise)?;
        Ok(Tick { inner, rig: self.rig.clone() })
    }
}

/// What a loop does with a measurement.
#[pyclass(module = "handeye.servo", frozen)]
pub struct Tick {
    inner: servo::Tick,
    rig: Arc<rig::Rig>,
}

#[pymethods]
impl Tick {
    /// What the robot shall do; hold where the loop waits or stops.
    #[getter]
    fn command(&self) -> MotionCommand {
        MotionCommand { inner: self.inner.command.clone() }
    }

    /// Mean distance of the features from where they shall be [px]; ``None`` where none of them is seen.
    #[getter]
    fn error_px(&self) -> Option<f64> {
        self.inner.error_px
    }

    /// What holds the motion back.
    #[getter]
    fn active(&self) -> Vec<Active> {
        Active::all(&self.inner.active, &self.rig)
    }

    /// Constraints that cannot all hold, where a limit gave way, in words.
    #[getter]
    fn conflict(&self) -> Vec<String> {
        words_of(&self.inner.conflict, &self.rig)
    }

    /// Why the robot is held, while the loop goes on.
    #[getter]
    fn waits(&self) -> Option<&str> {
        self.inner.waits.as_deref()
    }

    /// Why the loop has stopped; from then on every tick gives the same.
    #[getter]
    fn stop(&self) -> Option<Stop> {
        self.inner.stop.as_ref().map(|stop| Stop::new(stop, &self.rig))
    }

    fn __repr__(&self) -> String {
        let error = self.inner.error_px.map_or_else(|| "nothing seen".to_owned(), |error| format!("{error:.3} px"));
        let stop = self.inner.stop.as_ref().map_or_else(String::new, |stop| format!(", stopped: {}", stop.name()));
        format!("<handeye.servo.Tick {error}, {:?}{stop}>", self.inner.command)
    }
}
