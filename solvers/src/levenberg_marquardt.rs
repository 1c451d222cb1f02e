//! Levenberg-Marquardt with Nielsen's damping.
use crate::linear::{self, LinearSolver};
use crate::report::{Iteration, Observer, Report, Termination};
use crate::workspace::{Take, Workspace};
use crate::{Error, Graph};
use std::ops::ControlFlow;

/// Minimises Σ ρ(|r/σ|²)/2 by damped Gauss-Newton steps, (H + λ diag H) δ = -b.
///
/// λ follows Nielsen (Madsen, Nielsen, Tingleff 2004, algorithm 3.16): after a step that lowered the cost by the share ϱ of
/// what was predicted, λ shrinks by max(1/3, 1 - (2ϱ - 1)³); after one that did not, it grows by ν = 2, 4, 8, ...
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevenbergMarquardt {
    /// λ of the first step.
    pub initial_damping: f64,
    /// Most steps that are tried.
    pub max_iterations: usize,
    /// Stops where a step that was taken lowered the cost by less than this share of it.
    pub cost_tolerance: f64,
    /// Stops where no number moves by more than this share of its own size.
    pub step_tolerance: f64,
    /// Stops where the largest entry of b, each divided by the root of its diagonal entry of H, is below this.
    pub gradient_tolerance: f64,
    /// In the damping, no diagonal entry of H counts for less than this share of the largest that it has been, so that a
    /// number that all residuals lose sight of for a while is not thrown far. 0 is Marquardt's scaling, 1 that of Moré 1978.
    pub scale_memory: f64,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        LevenbergMarquardt {
            initial_damping: 1e-5,
            max_iterations: 100,
            cost_tolerance: 1e-10,
            step_tolerance: 1e-14,
            gradient_tolerance: 1e-12,
            scale_memory: 1e-6,
        }
    }
}

/// Diagonal entries of H below this share of the largest of all are damped as if they had it.
const SMALLEST_DIAGONAL: f64 = 1e-16;

/// λ beyond which a step no longer moves anything.
const LARGEST_DAMPING: f64 = 1e16;

impl LevenbergMarquardt {
    /// Moves the free nodes of the graph to a minimum.
    pub fn minimize(&self, graph: &mut Graph) -> Result<Report, Error> {
        self.minimize_with(graph, &mut Solver::new(graph), &mut |_| ControlFlow::Continue(()))
    }

    /// The same with buffers that are reused from call to call, and an observer that may cancel.
    pub fn minimize_with(
        &self,
        graph: &mut Graph,
        solver: &mut Solver,
        observer: Observer<'_>,
    ) -> Result<Report, Error> {
        solver.fit(graph);
        let Solver { workspace, linear, buffers } = solver;
        let Buffers { b, step, damping, diagonal, largest_diagonal, trial } = buffers;
        if b.is_empty() {
            return Err(Error::NothingFree);
        }
        let mut cost = workspace.linearize(graph, &graph.values, Take::All);
        if !cost.is_finite() {
            return Err(graph.first_not_finite(cost));
        }
        let initial_cost = cost;
        workspace.gradient(b);
        workspace.diagonal(diagonal);
        largest_diagonal.copy_from_slice(diagonal);
        let (mut lambda, mut nu) = (self.initial_damping, 2.0);
        let mut as_predicted = false;
        let mut iterations = 0;
        let termination = loop {
            let floor = SMALLEST_DIAGONAL * diagonal.iter().fold(1e-300, |most: f64, d| most.max(*d));
            let scaled = b.iter().zip(&*diagonal).map(|(b, d)| b.abs() / d.max(floor).sqrt());
            if scaled.fold(0.0, f64::max) <= self.gradient_tolerance {
                break Termination::GradientTolerance;
            }
            if iterations == self.max_iterations {
                break Termination::IterationLimit;
            }
            iterations += 1;
            for ((damping, d), most) in damping.iter_mut().zip(&*diagonal).zip(&mut *largest_diagonal) {
                *most = most.max(*d);
                *damping = lambda * d.max(floor).max(self.scale_memory * *most);
            }
            for (step, b) in step.iter_mut().zip(&*b) {
                *step = -b;
            }
            let solved = linear.factorize(workspace, damping);
            if solved {
                linear.solve(step);
            }
            if solved && step.iter().all(|s| s.is_finite()) {
                let largest = workspace.retract(graph, step, trial);
                if largest <= self.step_tolerance {
                    break Termination::StepTolerance;
                }
                let predicted: f64 = step.iter().zip(&*damping).zip(&*b).map(|((s, d), b)| 0.5 * s * (d * s - b)).sum();
                // A step that is likely to be taken, and not to be the last, is linearised at once: its cost comes along.
                let at_once = as_predicted && predicted > self.cost_tolerance * cost;
                let trial_cost =
                    if at_once { workspace.linearize(graph, trial, Take::All) } else { workspace.cost(graph, trial) };
                let gain = (cost - trial_cost) / predicted;
                if trial_cost < cost && gain > 0.0 {
                    std::mem::swap(&mut graph.values, trial);
                    let decrease = (cost - trial_cost) / cost;
                    cost = trial_cost;
                    if observer(&Iteration { number: iterations, cost }).is_break() {
                        break Termination::Cancelled;
                    }
                    if decrease <= self.cost_tolerance {
                        break Termination::CostTolerance;
                    }
                    if !at_once {
                        workspace.linearize(graph, &graph.values, Take::All);
                    }
                    workspace.gradient(b);
                    workspace.diagonal(diagonal);
                    as_predicted = gain > 0.5;
                    lambda *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                    nu = 2.0;
                    continue;
                }
                if at_once {
                    workspace.linearize(graph, &graph.values, Take::All);
                }
            }
            as_predicted = false;
            lambda *= nu;
            nu *= 2.0;
            if lambda > LARGEST_DAMPING {
                break Termination::NoProgress;
            }
            if observer(&Iteration { number: iterations, cost }).is_break() {
                break Termination::Cancelled;
            }
        };
        Ok(Report { iterations, initial_cost, final_cost: cost, termination, linear_solver: linear.name() })
    }
}

/// Workspace, linear solver and buffers of a minimiser: made once, reused for as long as the graph's structure stays.
pub struct Solver {
    pub(crate) workspace: Workspace,
    pub(crate) linear: Box<dyn LinearSolver>,
    pub(crate) buffers: Buffers,
}

pub(crate) struct Buffers {
    pub b: Vec<f64>,
    pub step: Vec<f64>,
    pub damping: Vec<f64>,
    pub diagonal: Vec<f64>,
    pub largest_diagonal: Vec<f64>,
    /// Values of all nodes after the step that is being tried.
    pub trial: Vec<f64>,
}

impl Solver {
    /// Chooses a linear solver from the graph's structure.
    pub fn new(graph: &Graph) -> Self {
        Self::with(graph, linear::choose)
    }

    /// With a linear solver of the caller's choice.
    pub fn with(graph: &Graph, choose: impl FnOnce(&Workspace) -> Box<dyn LinearSolver>) -> Self {
        let workspace = Workspace::new(graph);
        let n = workspace.layout.columns;
        let zeros = || vec![0.0; n];
        let buffers = Buffers {
            b: zeros(),
            step: zeros(),
            damping: zeros(),
            diagonal: zeros(),
            largest_diagonal: zeros(),
            trial: graph.values.clone(),
        };
        Solver { linear: choose(&workspace), workspace, buffers }
    }

    /// How the linear systems are solved.
    pub fn linear_solver(&self) -> &'static str {
        self.linear.name()
    }

    /// Starts over where the graph's structure has changed.
    pub(crate) fn fit(&mut self, graph: &Graph) {
        if !self.workspace.fits(graph) {
            *self = Solver::new(graph);
        }
        self.buffers.trial.clone_from(&graph.values);
    }
}
