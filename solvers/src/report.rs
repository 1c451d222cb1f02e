//! What a minimiser did. Not converging is a result, not an error.
use std::ops::ControlFlow;

/// Why a minimiser stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// The cost no longer changes.
    CostTolerance,
    /// The step no longer changes the values.
    StepTolerance,
    /// The gradient vanishes.
    GradientTolerance,
    /// No step lowers the cost, however short: the rounding of the cost is reached.
    NoProgress,
    /// The most iterations allowed were taken.
    IterationLimit,
    /// The observer asked to stop.
    Cancelled,
}

impl Termination {
    /// True where a minimum was reached, as far as can be told.
    pub fn converged(self) -> bool {
        !matches!(self, Termination::IterationLimit | Termination::Cancelled)
    }
}

/// One iteration, as an observer sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Counted from 1.
    pub number: usize,
    /// Σ ρ/2 after it.
    pub cost: f64,
}

/// What a minimiser did.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Steps tried, the rejected ones included.
    pub iterations: usize,
    /// Σ ρ/2 at the start.
    pub initial_cost: f64,
    /// Σ ρ/2 at the end.
    pub final_cost: f64,
    /// Why it stopped.
    pub termination: Termination,
    /// How the linear systems were solved.
    pub linear_solver: &'static str,
}

/// Called after every iteration; breaking off cancels the minimisation, and the best values so far are kept.
pub type Observer<'a> = &'a mut dyn FnMut(&Iteration) -> ControlFlow<()>;
