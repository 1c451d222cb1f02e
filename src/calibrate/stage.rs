//! Runs one stage and keeps count of it.
use super::graph::{Freedom, Priors, State, build};
use super::setup::Setup;
use super::{Observer, Progress, StageReport};
use crate::Error;
use handeye_solvers::{LevenbergMarquardt, Loss, Report, Solver};
use std::time::Instant;

/// The stages so far, and who watches them.
pub(crate) struct Stages<'a> {
    pub reports: Vec<StageReport>,
    pub observer: Observer<'a>,
    pub cancelled: bool,
}

/// Most iterations of a stage.
const ITERATIONS: usize = 200;

impl Stages<'_> {
    /// Minimises over what is free, and moves the state there.
    #[allow(clippy::too_many_arguments)]
    pub fn minimize(
        &mut self,
        name: &str,
        setup: &Setup,
        state: &mut State,
        freedom: &Freedom,
        priors: &Priors,
        loss: Loss,
        takes_part: impl Fn(usize) -> bool,
    ) -> Result<Report, Error> {
        let started = Instant::now();
        let mut built = build(setup, state, freedom, priors, loss, takes_part);
        let pixels = setup.sigma() * (2.0 / built.factors.len().max(1) as f64).sqrt();
        let mut solver = Solver::new(&built.graph);
        let minimizer = LevenbergMarquardt { max_iterations: ITERATIONS, ..Default::default() };
        let observer = &mut self.observer;
        let report = minimizer.minimize_with(&mut built.graph, &mut solver, &mut |iteration| {
            observer(&Progress {
                stage: name,
                done: iteration.number,
                of: ITERATIONS,
                rms_px: Some(pixels * iteration.cost.sqrt()),
            })
        })?;
        built.read(state);
        self.cancelled |= report.termination == handeye_solvers::Termination::Cancelled;
        if self.cancelled {
            return Err(Error::NotEnoughData("cancelled".into()));
        }
        self.reports.push(StageReport {
            name: name.to_owned(),
            iterations: report.iterations,
            loss_before: report.initial_cost,
            loss_after: report.final_cost,
            seconds: started.elapsed().as_secs_f64(),
        });
        Ok(report)
    }

    /// Notes a stage that was no minimisation of the graph.
    pub fn record(&mut self, name: &str, loss_after: f64, started: Instant) {
        self.reports.push(StageReport {
            name: name.to_owned(),
            iterations: 0,
            loss_before: f64::NAN,
            loss_after,
            seconds: started.elapsed().as_secs_f64(),
        });
    }
}
