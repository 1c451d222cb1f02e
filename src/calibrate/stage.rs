//! Stages of a calibration as data, and the one way to run them.
use super::graph::{Built, Freedom, Priors, State, build};
use super::observation::Kind;
use super::setup::Setup;
use super::{Observer, Progress, StageReport};
use crate::Error;
use handeye_solvers::{LevenbergMarquardt, Loss, Report, Solver, Termination};
use std::time::Instant;

/// What one stage minimises: which numbers are free, which observations take part, and how much a large error pulls.
pub(crate) struct Stage<'a> {
    pub name: &'a str,
    pub freedom: &'a Freedom,
    pub loss: Loss,
    pub takes_part: &'a dyn Fn(usize) -> bool,
}

/// A calibration on its way: what is given, the stages so far, and who watches them.
pub(crate) struct Stages<'a> {
    pub setup: &'a Setup,
    pub priors: &'a Priors,
    /// Most iterations of a stage.
    pub iterations: usize,
    pub reports: Vec<StageReport>,
    pub observer: Observer<'a>,
}

impl<'a> Stages<'a> {
    pub fn new(setup: &'a Setup, priors: &'a Priors, iterations: usize, observer: Observer<'a>) -> Self {
        Stages { setup, priors, iterations, reports: Vec::new(), observer }
    }

    /// The graph of a stage at a state.
    pub fn build(&self, stage: &Stage<'_>, state: &State) -> Built {
        build(self.setup, state, stage.freedom, self.priors, stage.loss, stage.takes_part)
    }

    /// The graph over all observations of placed samples.
    pub fn build_on(&self, freedom: &Freedom, loss: Loss, state: &State) -> Built {
        build(self.setup, state, freedom, self.priors, loss, |_| true)
    }

    /// Minimises, and moves the state there.
    pub fn minimize(&mut self, stage: &Stage<'_>, state: &mut State) -> Result<Report, Error> {
        let started = Instant::now();
        let mut built = self.build(stage, state);
        let coordinates: f64 =
            built.factors.iter().map(|(index, _)| self.setup.observations[*index].kind().coordinates()).sum();
        // The root mean square of two coordinates, each of which costs half its square.
        let pixels = 2.0 * self.setup.sd(Kind::Pixels) / coordinates.max(1.0).sqrt();
        let has_pixels = self.setup.has(Kind::Pixels);
        let mut solver = Solver::new(&built.graph);
        let minimizer = LevenbergMarquardt { max_iterations: self.iterations, ..Default::default() };
        let (observer, of) = (&mut self.observer, self.iterations);
        let report = minimizer.minimize_with(&mut built.graph, &mut solver, &mut |iteration| {
            observer(&Progress {
                stage: stage.name,
                done: iteration.number,
                of,
                rms_px: has_pixels.then(|| pixels * iteration.cost.sqrt()),
            })
        })?;
        if report.termination == Termination::Cancelled {
            return Err(Error::Cancelled);
        }
        built.read(state);
        self.record(stage.name, report.iterations, (report.initial_cost, report.final_cost), started);
        Ok(report)
    }

    /// Notes a stage, with its loss before and after.
    pub fn record(&mut self, name: &str, iterations: usize, (before, after): (f64, f64), started: Instant) {
        self.reports.push(StageReport {
            name: name.to_owned(),
            iterations,
            loss_before: before,
            loss_after: after,
            seconds: started.elapsed().as_secs_f64(),
        });
    }
}
