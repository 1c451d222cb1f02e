//! Graduated non-convexity: gross outliers lose their pull step by step.
use crate::{Error, Graph, Iteration, LevenbergMarquardt, Loss, Observer, Report, Solver, Termination};
use std::ops::ControlFlow;

/// Minimises a graph with [`Loss::GemanMcClure`] factors from wherever it starts (Yang, Antonante, Tzoumas, Carlone 2020,
/// GNC-GM).
///
/// The loss starts as good as squared, k² μ in place of k² with μ = 2 max(s/k²) at the squared optimum, and narrows by
/// `ratio` to itself at μ = 1. It finds the inliers among 60 % of outliers and more, as long as the squared optimum is not
/// already a consistent wrong answer. Factors with other losses keep them throughout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Graduated {
    /// Minimises at every μ.
    pub minimizer: LevenbergMarquardt,
    /// How much μ shrinks each time; the paper's 1.4.
    pub ratio: f64,
    /// Most steps at every μ but the last; few are enough, because the next μ changes the weights anyway.
    pub iterations_each: usize,
}

impl Default for Graduated {
    fn default() -> Self {
        Graduated { minimizer: LevenbergMarquardt::default(), ratio: 1.4, iterations_each: 10 }
    }
}

/// μ so large that Geman-McClure is squared.
const SQUARED: f64 = 1e12;

/// Change of the cost at which a μ that is not the last is done with.
const COARSE: f64 = 1e-5;

impl Graduated {
    /// Moves the free nodes of the graph to a minimum.
    pub fn minimize(&self, graph: &mut Graph) -> Result<Report, Error> {
        self.minimize_with(graph, &mut Solver::new(graph), &mut |_| ControlFlow::Continue(()))
    }

    /// The same with buffers that are reused from call to call, and an observer that may cancel; it sees the cost at the
    /// present μ. The report's costs are those of the loss itself, μ = 1.
    pub fn minimize_with(
        &self,
        graph: &mut Graph,
        solver: &mut Solver,
        observer: Observer<'_>,
    ) -> Result<Report, Error> {
        let result = self.anneal(graph, solver, observer);
        graph.graduation = 1.0;
        result
    }

    fn anneal(&self, graph: &mut Graph, solver: &mut Solver, observer: Observer<'_>) -> Result<Report, Error> {
        solver.fit(graph);
        let initial_cost = solver.workspace.cost(graph, &graph.values);
        let coarse = LevenbergMarquardt {
            max_iterations: self.iterations_each.min(self.minimizer.max_iterations),
            cost_tolerance: self.minimizer.cost_tolerance.max(COARSE),
            ..self.minimizer
        };
        let mut done = 0;
        let mut run = |minimizer: &LevenbergMarquardt, graph: &mut Graph, mu: f64| {
            graph.graduation = mu;
            let mut count =
                |iteration: &Iteration| observer(&Iteration { number: done + iteration.number, cost: iteration.cost });
            let report = minimizer.minimize_with(graph, solver, &mut count)?;
            done += report.iterations;
            Ok(Report { iterations: done, initial_cost, ..report })
        };
        let mut report = run(&coarse, graph, SQUARED)?;
        let mut mu = 2.0 * largest(graph);
        while mu > 1.0 && report.termination != Termination::Cancelled {
            report = run(&coarse, graph, mu)?;
            mu /= self.ratio;
        }
        if report.termination == Termination::Cancelled {
            graph.graduation = 1.0;
            return Ok(Report { final_cost: solver.workspace.cost(graph, &graph.values), ..report });
        }
        run(&self.minimizer, graph, 1.0)
    }
}

/// The largest s/k² over all Geman-McClure factors.
fn largest(graph: &Graph) -> f64 {
    let ratio = |key: &crate::FactorKey| {
        let pool = &graph.factors[key.pool as usize];
        let Loss::GemanMcClure(k) = pool.loss(key.place as usize) else { return 0.0 };
        graph.squared_norm(*key) / (k * k)
    };
    graph.order.iter().map(ratio).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Factor, Scalar, Vector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// y = a x + b.
    struct Point(f64, f64);
    impl Factor<1> for Point {
        type On = (Vector<2>,);
        fn residual<T: Scalar>(&self, (line,): (Vector<2, T>,)) -> [T; 1] {
            [line.x * self.0 + line.y - self.1]
        }
    }

    const SIGMA: f64 = 0.05;

    fn fit(points: &[Point], loss: Loss) -> Vector<2> {
        let mut graph = Graph::new();
        let line = graph.free(Vector::<2>::zeros());
        for point in points {
            graph.factor(Point(point.0, point.1), (line,)).sigma(SIGMA).loss(loss);
        }
        assert!(Graduated::default().minimize(&mut graph).unwrap().termination.converged());
        graph.value(line)
    }

    #[test]
    fn a_line_is_found_among_outliers_where_least_squares_is_lost() {
        // 50, 60 and 70 % of 100 points are uniform in a box that the line crosses; σ = 0.05, k = 3. The inlier fit is the
        // truth to 4 σ / √30 = 0.037, and outliers that happen to lie within 3 σ of the line move it by no more than that again.
        let (mut lost, mut squared_lost) = (0, 0);
        for seed in 0..100 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let outliers = [50, 60, 70][seed as usize % 3];
            let truth = Vector::<2>::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0));
            let points: Vec<Point> = (0..100)
                .map(|i| {
                    let x = random.random_range(-1.0..1.0);
                    // The sum of 12 uniform numbers has variance 1.
                    let noise = (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>() * SIGMA;
                    let y = if i < outliers { random.random_range(-4.0..4.0) } else { truth.x * x + truth.y + noise };
                    Point(x, y)
                })
                .collect();
            let inliers: Vec<Point> = points[outliers..].iter().map(|p| Point(p.0, p.1)).collect();
            let expected = fit(&inliers, Loss::Squared);
            lost += usize::from((fit(&points, Loss::GemanMcClure(3.0)) - expected).norm() > 0.075);
            squared_lost += usize::from((fit(&points, Loss::Squared) - expected).norm() > 0.075);
        }
        assert_eq!(lost, 0);
        assert!(squared_lost > 90, "{squared_lost}");
    }
}
