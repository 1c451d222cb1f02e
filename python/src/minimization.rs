//! What a minimiser did.
use handeye::solvers::{self, Termination};
use pyo3::prelude::*;

/// What a minimiser did.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct Minimization {
    /// Steps tried, the rejected ones included.
    iterations: usize,
    /// Sum of rho / 2 at the start.
    initial_cost: f64,
    /// Sum of rho / 2 at the end.
    final_cost: f64,
    /// True where a minimum was reached, as far as can be told.
    converged: bool,
    /// Why it stopped, in words.
    termination: &'static str,
}

#[pymethods]
impl Minimization {
    fn __repr__(&self) -> String {
        let Minimization { iterations, initial_cost, final_cost, termination, .. } = self;
        format!(
            "<handeye.Minimization {iterations} iterations, cost {initial_cost:.4e} -> {final_cost:.4e}: {termination}>"
        )
    }
}

fn termination_in_words(termination: Termination) -> &'static str {
    match termination {
        Termination::CostTolerance => "the cost no longer changes",
        Termination::StepTolerance => "the step no longer changes the values",
        Termination::GradientTolerance => "the gradient vanishes",
        Termination::NoProgress => "no step lowers the cost",
        Termination::IterationLimit => "the most iterations allowed were taken",
        Termination::Cancelled => "cancelled",
    }
}

impl From<solvers::Report> for Minimization {
    fn from(report: solvers::Report) -> Self {
        Minimization {
            iterations: report.iterations,
            initial_cost: report.initial_cost,
            final_cost: report.final_cost,
            converged: report.termination.converged(),
            termination: termination_in_words(report.termination),
        }
    }
}
