//! Gauss-Newton: undamped steps, halved where they would raise the cost.
use crate::levenberg_marquardt::{Buffers, Solver};
use crate::report::{Iteration, Observer, Report, Termination};
use crate::workspace::Take;
use crate::{Error, Graph};
use std::ops::ControlFlow;

/// Minimises Σ ρ(|r/σ|²)/2 by steps H δ = -b.
///
/// Takes fewer iterations than [`LevenbergMarquardt`](crate::LevenbergMarquardt) near a minimum that the data determine
/// well; far from one, or where they leave a direction open, prefer that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussNewton {
    /// Most steps that are taken.
    pub max_iterations: usize,
    /// How often a step that does not lower the cost is halved. 0 takes every step in full, uphill too.
    pub halvings: usize,
    /// Stops where a step changes the cost by less than this share of it.
    pub cost_tolerance: f64,
    /// Stops where no number moves by more than this share of its own size (absolute below 1).
    pub step_tolerance: f64,
    /// Stops where the largest entry of b, each divided by the root of its diagonal entry of H, is below this.
    pub gradient_tolerance: f64,
}

impl Default for GaussNewton {
    fn default() -> Self {
        GaussNewton {
            max_iterations: 100,
            halvings: 20,
            cost_tolerance: 1e-10,
            step_tolerance: 1e-14,
            gradient_tolerance: 1e-12,
        }
    }
}

impl GaussNewton {
    /// Moves the free nodes of the graph to a minimum.
    ///
    /// [`Error::Singular`] where H is singular on the way; the nodes stay at the last values before it.
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
        let Buffers { b, step, damping, diagonal, trial, .. } = buffers;
        if b.is_empty() {
            return Err(Error::NothingFree);
        }
        damping.fill(0.0);
        let mut cost = workspace.linearize(graph, &graph.values, Take::All);
        if !cost.is_finite() {
            return Err(graph.first_not_finite(cost));
        }
        let initial_cost = cost;
        let mut iterations = 0;
        let termination = loop {
            workspace.gradient(b);
            workspace.diagonal(diagonal);
            let scaled = b.iter().zip(&*diagonal).map(|(b, d)| b.abs() / d.max(f64::MIN_POSITIVE).sqrt());
            if scaled.fold(0.0, f64::max) <= self.gradient_tolerance {
                break Termination::GradientTolerance;
            }
            if iterations == self.max_iterations {
                break Termination::IterationLimit;
            }
            iterations += 1;
            if !linear.factorize(workspace, damping) {
                return Err(Error::Singular);
            }
            for (step, b) in step.iter_mut().zip(&*b) {
                *step = -b;
            }
            linear.solve(step);
            if step.iter().any(|s| !s.is_finite()) {
                return Err(Error::Singular);
            }
            if workspace.retract(graph, step, trial) <= self.step_tolerance {
                break Termination::StepTolerance;
            }
            let mut trial_cost = workspace.cost(graph, trial);
            for _ in 0..self.halvings {
                if trial_cost <= cost {
                    break;
                }
                step.iter_mut().for_each(|s| *s *= 0.5);
                workspace.retract(graph, step, trial);
                trial_cost = workspace.cost(graph, trial);
            }
            let uphill = trial_cost > cost && self.halvings > 0;
            if uphill || !trial_cost.is_finite() {
                break Termination::NoProgress;
            }
            std::mem::swap(&mut graph.values, trial);
            let change = (cost - trial_cost).abs() / cost;
            cost = trial_cost;
            if observer(&Iteration { number: iterations, cost }).is_break() {
                break Termination::Cancelled;
            }
            if change <= self.cost_tolerance {
                break Termination::CostTolerance;
            }
            cost = workspace.linearize(graph, &graph.values, Take::All);
        };
        Ok(Report { iterations, initial_cost, final_cost: cost, termination, linear_solver: linear.name() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Factor, LevenbergMarquardt, Scalar, Vector};

    struct Circle(f64, f64, f64);
    impl Factor<1> for Circle {
        type On = (Vector<2>,);
        fn residual<T: Scalar>(&self, (p,): (Vector<2, T>,)) -> [T; 1] {
            [((p.x - self.0) * (p.x - self.0) + (p.y - self.1) * (p.y - self.1)).sqrt() - self.2]
        }
    }

    fn beacons() -> (Graph, crate::Key<Vector<2>>) {
        let mut graph = Graph::new();
        let point = graph.free(Vector::<2>::new(-8.0, 9.0));
        for (x, y, distance) in [(0.0, 0.0, 5.1), (10.0, 0.0, 8.0), (0.0, 10.0, 6.8), (10.0, 10.0, 9.2)] {
            graph.factor(Circle(x, y, distance), (point,)).sigma(0.1);
        }
        (graph, point)
    }

    #[test]
    fn reaches_the_optimum_of_levenberg_marquardt() {
        let ((mut a, point), (mut b, _)) = (beacons(), beacons());
        let report = GaussNewton::default().minimize(&mut a).unwrap();
        LevenbergMarquardt::default().minimize(&mut b).unwrap();
        assert!(report.termination.converged(), "{report:?}");
        assert!((a.value(point) - b.value(point)).norm() < 1e-7);
    }

    #[test]
    fn an_open_direction_is_an_error() {
        let mut graph = Graph::new();
        let point = graph.free(Vector::<2>::new(1.0, 0.0));
        graph.factor(Circle(0.0, 0.0, 2.0), (point,));
        assert_eq!(GaussNewton::default().minimize(&mut graph), Err(Error::Singular));
    }
}
