//! One servo run in the scene, and runs around the target.
use super::world::{Scene, Tracker, View, World};
use crate::Error;
use crate::experiments::controlled::{self, Convergence};
use crate::servo::uncalibrated::{Settings, Stop};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// How a run went.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Sum of the absolute errors before each iteration and after the last [px]; fewer where it was stopped.
    pub errors: Vec<f64>,
    /// The same of the points in space, at the end [m].
    pub error_3d: f64,
    /// Condition number after exploring; `None` where that found none.
    pub condition: Option<f64>,
    /// Why it was stopped, where it was.
    pub stop: Option<Stop>,
}

/// Iterations of a run.
pub const ITERATIONS: usize = 50;

/// The error below which the thesis counts steps [px].
const NEAR: f64 = 10.0;

impl Run {
    /// True where the errors grew by more than the settings allow.
    pub fn diverged(&self) -> bool {
        matches!(self.stop, Some(Stop::Diverged { .. }))
    }

    /// Iterations, in strides of `every`, until the errors sum up to less than 10 px; `None` where they never do.
    pub fn steps(&self, every: usize) -> Option<usize> {
        self.errors.iter().step_by(every).position(|error| *error < NEAR)
    }
}

/// Servoes from the start, [`ITERATIONS`] times after exploring unless it is stopped before; those that explore again are some of them.
///
/// Errors: what [`crate::servo::uncalibrated::Uncalibrated::new`] refuses.
pub fn servo(world: &mut World, settings: &Settings) -> Result<Run, Error> {
    let Convergence { errors, condition, stop } = controlled::servo(world, settings, ITERATIONS, &mut |_, _| ())?;
    Ok(Run { errors, error_3d: world.error_3d(), condition, stop })
}

/// Runs with a pair of cameras at `placements` places around the target, evenly.
///
/// Errors: as [`servo`].
pub fn carried_around(
    scene: &Scene,
    tracker: Tracker,
    settings: &Settings,
    placements: usize,
    seed: u64,
) -> Result<Vec<Run>, Error> {
    let place = |index: usize| {
        let angle = TAU * index as f64 / placements as f64;
        let seed = seed.wrapping_mul(1_000_000).wrapping_add(index as u64);
        servo(&mut World::new(scene, &View::pair(angle), tracker, seed)?, settings)
    };
    let runs: Vec<Result<Run, Error>> = (0..placements).into_par_iter().map(place).collect();
    runs.into_iter().collect()
}
