//! L-BFGS: steps from gradients alone, on all the data or on random parts of it first.
use crate::report::{Iteration, Observer, Report, Termination};
use crate::tangent::Tangent;
use crate::workspace::{Mask, Workspace};
use crate::{Error, Graph, Minibatches};
use argmin::core::{CostFunction, Gradient, IterState, Problem, Solver, State};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::cell::RefCell;
use std::ops::ControlFlow;

/// Minimises Σ ρ(|r/σ|²)/2 by L-BFGS with the line search of Moré and Thuente (Nocedal and Wright 2006, algorithm 7.5).
///
/// Needs no normal equations after the first evaluation, so it stays cheap where many numbers are tied to each other; takes
/// many more iterations than [`LevenbergMarquardt`](crate::LevenbergMarquardt), which is the better choice elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lbfgs {
    /// Pairs of steps and gradients that are remembered.
    pub memory: usize,
    /// Most steps on all the data.
    pub max_iterations: usize,
    /// Stops where three steps in a row each lower the cost by less than this share of it.
    pub cost_tolerance: f64,
    /// Stops where the largest entry of b, each divided by the root of its diagonal entry of H at the start, is below this.
    pub gradient_tolerance: f64,
}

impl Default for Lbfgs {
    fn default() -> Self {
        Lbfgs { memory: 30, max_iterations: 2_000, cost_tolerance: 1e-12, gradient_tolerance: 1e-9 }
    }
}

/// Evaluations in one line search, at most.
const EVALUATIONS: usize = 50;

/// First step lengths that are tried, from the best values so far, after a line search has failed.
const SHORTER: [f64; 3] = [1.0, 1e-3, 1e-6];

impl Lbfgs {
    /// Moves the free nodes of the graph to a minimum.
    pub fn minimize(&self, graph: &mut Graph) -> Result<Report, Error> {
        self.minimize_with(graph, None, &mut |_| ControlFlow::Continue(()))
    }

    /// The same with minibatches before all the data, and an observer that may cancel; on a minibatch it sees the
    /// minibatch's cost.
    pub fn minimize_with(
        &self,
        graph: &mut Graph,
        minibatches: Option<&Minibatches>,
        observer: Observer<'_>,
    ) -> Result<Report, Error> {
        // Steps from fixed values leave the span of the free coordinates of later values: the whole gradient is needed, of
        // which the free coordinates at the fixed values are taken.
        let free: Vec<Option<Vec<u16>>> = graph.nodes.iter().map(|node| node.free.clone()).collect();
        for node in graph.nodes.iter_mut().filter(|node| node.free.as_ref().is_some_and(|free| !free.is_empty())) {
            node.free = None;
        }
        let result = self.run(graph, &free, minibatches, observer);
        graph.nodes.iter_mut().zip(free).for_each(|(node, free)| node.free = free);
        result
    }

    fn run(
        &self,
        graph: &mut Graph,
        free: &[Option<Vec<u16>>],
        minibatches: Option<&Minibatches>,
        observer: Observer<'_>,
    ) -> Result<Report, Error> {
        let mut workspace = Workspace::new(graph);
        let variables = variables(graph, &workspace, free);
        if variables.is_empty() {
            return Err(Error::NothingFree);
        }
        let initial_cost = workspace.cost(graph, &graph.values);
        if !initial_cost.is_finite() {
            return Err(graph.first_not_finite(initial_cost));
        }
        let mut phase = Phase { workspace: &mut workspace, variables: &variables, iterations: 0, observer };
        let mut termination = Termination::IterationLimit;
        if let Some(minibatches) = minibatches {
            let mut random = ChaCha8Rng::seed_from_u64(minibatches.seed);
            let limited = Lbfgs { max_iterations: minibatches.iterations_each, ..*self };
            for _ in 0..minibatches.batches {
                let mask = minibatches.draw(graph, &mut random);
                termination = phase.minimize(&limited, graph, Some(&mask));
                if termination == Termination::Cancelled {
                    break;
                }
            }
        }
        if termination != Termination::Cancelled {
            termination = phase.minimize(self, graph, None);
        }
        let iterations = phase.iterations;
        let final_cost = workspace.cost(graph, &graph.values);
        Ok(Report { iterations, initial_cost, final_cost, termination, linear_solver: "none" })
    }
}

/// (node, coordinate, column) of every number that is free, in a workspace where all coordinates of its nodes are.
fn variables(graph: &Graph, workspace: &Workspace, free: &[Option<Vec<u16>>]) -> Vec<(u32, usize, usize)> {
    let mut variables = Vec::new();
    for &(node, column) in &workspace.layout.free {
        let coordinates: Vec<usize> = match &free[node as usize] {
            Some(free) => free.iter().map(|&coordinate| usize::from(coordinate)).collect(),
            None => (0..graph.nodes[node as usize].tangent).collect(),
        };
        variables.extend(coordinates.into_iter().map(|coordinate| (node, coordinate, column + coordinate)));
    }
    variables
}

/// What the minimisations of all minibatches, and the last one, have in common.
struct Phase<'a, 'o> {
    workspace: &'a mut Workspace,
    variables: &'a [(u32, usize, usize)],
    iterations: usize,
    observer: Observer<'o>,
}

impl Phase<'_, '_> {
    /// Moves the graph to a minimum of the factors of a mask. A line search that fails is begun again from the best values,
    /// with an empty memory and a shorter first step.
    fn minimize(&mut self, settings: &Lbfgs, graph: &mut Graph, mask: Option<&Mask>) -> Termination {
        let mut left = settings.max_iterations;
        let mut failures = 0;
        loop {
            let before = self.iterations;
            // After a failure one short step, and then full ones again.
            let steps = if failures == 0 { left } else { left.min(1) };
            let ended = self.attempt(settings, graph, mask, steps, SHORTER[failures]);
            left -= self.iterations - before;
            let advanced = self.iterations > before;
            match ended {
                Some(Termination::IterationLimit) if left > 0 => failures = 0,
                Some(termination) => return termination,
                None if advanced => failures = 0,
                None => failures += 1,
            }
            if failures == SHORTER.len() {
                return Termination::NoProgress;
            }
        }
    }

    /// `None` where the line search failed.
    fn attempt(
        &mut self,
        settings: &Lbfgs,
        graph: &mut Graph,
        mask: Option<&Mask>,
        steps: usize,
        first_step: f64,
    ) -> Option<Termination> {
        let tangent = RefCell::new(Tangent::new(graph, self.workspace, mask, self.variables));
        let mut problem = Problem::new(Objective(&tangent));
        let mut search = MoreThuenteLineSearch::new();
        argmin::core::LineSearch::<Vec<f64>, f64>::initial_step_length(&mut search, first_step).ok()?;
        let mut solver = LBFGS::new(search, settings.memory);
        let start = IterState::<Vec<f64>, Vec<f64>, (), (), (), f64>::new().param(vec![0.0; self.variables.len()]);
        let (mut state, _) = solver.init(&mut problem, start).ok()?;
        let mut small = 0;
        let mut taken = 0;
        let ended = loop {
            let gradient = state.get_gradient()?;
            if gradient.iter().fold(0.0, |most: f64, g| most.max(g.abs())) <= settings.gradient_tolerance {
                break Some(Termination::GradientTolerance);
            }
            if taken == steps {
                break Some(Termination::IterationLimit);
            }
            let cost = state.get_cost();
            tangent.borrow_mut().evaluations = 0;
            let Ok((next, _)) = solver.next_iter(&mut problem, state) else { break None };
            state = next;
            if state.terminated() {
                break None;
            }
            state.increment_iter();
            let decrease = (cost - state.get_cost()) / cost;
            if decrease <= 0.0 || decrease.is_nan() {
                break if small > 0 { Some(Termination::CostTolerance) } else { None };
            }
            taken += 1;
            self.iterations += 1;
            let iteration = Iteration { number: self.iterations, cost: state.get_cost() };
            if (self.observer)(&iteration).is_break() {
                break Some(Termination::Cancelled);
            }
            small = if decrease <= settings.cost_tolerance { small + 1 } else { 0 };
            if small == 3 {
                break Some(Termination::CostTolerance);
            }
        };
        let best = tangent.into_inner().best;
        if let Some((_, values)) = best {
            graph.values = values;
        }
        ended
    }
}

/// How argmin sees a tangent: it takes its problems by value, and loses them where a line search fails.
struct Objective<'a, 'b>(&'a RefCell<Tangent<'b>>);

impl CostFunction for Objective<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let mut tangent = self.0.borrow_mut();
        let cost = tangent.cost(z);
        if !cost.is_finite() || tangent.evaluations > EVALUATIONS {
            return Err(argmin::core::Error::msg("the line search ends nowhere"));
        }
        Ok(cost)
    }
}

impl Gradient for Objective<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, z: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        Ok(self.0.borrow_mut().gradient(z))
    }
}
