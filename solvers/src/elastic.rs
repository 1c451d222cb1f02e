//! Small quadratic programs whose rows cannot all hold: where the weakest of them give way.
use super::quadratic_program::{Qp, inside};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};

/// Clarabel on the scaled problem with a slack for each row: x = D y, cost divided by κ, rows divided by their norms. Of one shape for
/// good, so that it is set up once and updated in place.
pub(crate) struct Elastic {
    n: usize,
    /// Rows, of which the last may be off: 0·y ≤ 1.
    m: usize,
    solver: Option<DefaultSolver<f64>>,
    p: Vec<f64>,
    q: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    norms: Vec<f64>,
    /// x.
    pub x: Vec<f64>,
    /// Multipliers of the box: positive where `upper` holds x back, negative where `lower` does.
    pub of_box: Vec<f64>,
    /// Multipliers of the rows in use.
    pub of_rows: Vec<f64>,
    /// Iterations that Clarabel took.
    pub iterations: u32,
}

/// Price of a unit of a scaled row's violation, where no scaled gradient exceeds 1: more than the multipliers that avoid it.
const PRICE: f64 = 100.0;

/// A bound this far away is none, in units of the scaled step.
const FAR: f64 = 1e4;

/// Tolerances of Clarabel on the scaled problem: a step is right to a millionth of its box or better.
const TOLERANCE: f64 = 1e-9;

/// How far Clarabel's steps go towards the border: where two rows that face each other both give way, it goes round in circles in one of
/// some thousand problems, and arrives with shorter steps.
const STEP_FRACTIONS: [f64; 2] = [0.99, 0.8];

/// Scaled multipliers below this are zero.
const INACTIVE: f64 = 1e-5;

impl Elastic {
    /// For `n` unknowns and up to `m` rows. Clarabel is set up when it is first needed.
    pub fn new(n: usize, m: usize) -> Self {
        let list = Vec::new;
        Elastic {
            n,
            m,
            solver: None,
            p: list(),
            q: list(),
            a: list(),
            b: list(),
            norms: list(),
            x: list(),
            of_box: list(),
            of_rows: list(),
            iterations: 0,
        }
    }

    /// Most rows that it takes.
    pub fn rows(&self) -> usize {
        self.m
    }

    /// Solves with these rows of a problem in these units of the unknowns; false where Clarabel does not arrive.
    pub fn solve(&mut self, qp: &Qp<'_>, rows: &[usize], scale: &[f64]) -> bool {
        let n = self.n;
        let kappa = self.fill(qp, rows, scale);
        let updated = match &mut self.solver {
            Some(solver) => {
                solver.update_P(&self.p).is_ok()
                    && solver.update_q(&self.q).is_ok()
                    && solver.update_A(&self.a).is_ok()
                    && solver.update_b(&self.b).is_ok()
            }
            None => {
                self.solver = self.set_up();
                true
            }
        };
        let Some(solver) = self.solver.as_mut().filter(|_| updated) else { return false };
        self.iterations = 0;
        let arrived = STEP_FRACTIONS.into_iter().any(|fraction| {
            if solver.settings().max_step_fraction != fraction && solver.update_settings(settings(fraction)).is_err() {
                return false;
            }
            solver.solve();
            self.iterations += solver.solution.iterations;
            let numbers = solver.solution.x.iter().chain(&solver.solution.z);
            matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved)
                && numbers.copied().all(f64::is_finite)
        });
        if !arrived {
            return false;
        }
        let found = &solver.solution;
        let multiplier = |z: f64| if z > INACTIVE { z } else { 0.0 };
        self.x.clear();
        self.x.extend((0..n).map(|i| inside(scale[i] * found.x[i], qp.lower[i], qp.upper[i])));
        self.of_box.clear();
        self.of_box.extend((0..n).map(|i| (multiplier(found.z[i]) - multiplier(found.z[n + i])) * kappa / scale[i]));
        self.of_rows.clear();
        self.of_rows.extend((0..rows.len()).map(|i| multiplier(found.z[2 * n + i]) * kappa / self.norms[i]));
        true
    }

    /// Fills in the scaled problem and returns κ. Unknowns of Clarabel: y, then slacks; its rows: upper, lower, rows, slacks ≥ 0.
    fn fill(&mut self, qp: &Qp<'_>, rows: &[usize], d: &[f64]) -> f64 {
        let (n, off) = (self.n, self.m - rows.len());
        let trace: f64 = (0..n).map(|i| qp.hessian[i * n + i] * d[i] * d[i]).sum();
        let steepest = (0..n).map(|i| (qp.gradient[i] * d[i]).abs()).fold(0.0, f64::max);
        let kappa = (trace / n as f64).max(steepest);
        self.q.clear();
        self.q.extend((0..n).map(|i| qp.gradient[i] * d[i] / kappa));
        self.q.extend(rows.iter().map(|&row| qp.strengths[row].clamp(1.0, 100.0) * PRICE));
        self.q.extend(std::iter::repeat_n(1.0, off));
        // The upper triangle of P by columns, with a little curvature for each slack.
        self.p.clear();
        for j in 0..n {
            self.p.extend((0..=j).map(|i| qp.hessian[j * n + i] * d[i] * d[j] / kappa));
        }
        self.p.extend(std::iter::repeat_n(1.0, self.m));
        self.norms.clear();
        self.norms.extend(rows.iter().map(|&row| {
            let slopes = &qp.rows[row * n..(row + 1) * n];
            slopes.iter().zip(d).map(|(a, d)| (a * d) * (a * d)).sum::<f64>().sqrt().max(1e-12)
        }));
        self.b.clear();
        let near = |bound: f64| bound.clamp(-FAR, FAR);
        self.b.extend((0..n).map(|i| near(qp.upper[i].max(qp.lower[i]) / d[i])));
        self.b.extend((0..n).map(|i| near(-qp.lower[i] / d[i])));
        self.b.extend(rows.iter().zip(&self.norms).map(|(&row, norm)| near(qp.bounds[row] / norm)));
        self.b.extend(std::iter::repeat_n(1.0, off));
        self.b.extend(std::iter::repeat_n(0.0, self.m));
        self.a.clear();
        for (j, d) in d.iter().enumerate() {
            self.a.extend([1.0, -1.0]);
            self.a.extend(rows.iter().zip(&self.norms).map(|(&row, norm)| qp.rows[row * n + j] * d / norm));
            self.a.extend(std::iter::repeat_n(0.0, off));
        }
        self.a.extend(std::iter::repeat_n(-1.0, 2 * self.m));
        kappa
    }

    /// Clarabel with the pattern of all problems of the shape.
    fn set_up(&self) -> Option<DefaultSolver<f64>> {
        let (n, m) = (self.n, self.m);
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for j in 0..n {
            rows.extend(0..=j);
            columns.push(rows.len());
        }
        for i in 0..m {
            rows.push(n + i);
            columns.push(rows.len());
        }
        let p = CscMatrix::new(n + m, n + m, columns, rows, self.p.clone());
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for j in 0..n {
            rows.extend([j, n + j]);
            rows.extend(2 * n..2 * n + m);
            columns.push(rows.len());
        }
        for i in 0..m {
            rows.extend([2 * n + i, 2 * n + m + i]);
            columns.push(rows.len());
        }
        let a = CscMatrix::new(2 * (n + m), n + m, columns, rows, self.a.clone());
        DefaultSolver::new(&p, &self.q, &a, &self.b, &[NonnegativeConeT(2 * (n + m))], settings(STEP_FRACTIONS[0])).ok()
    }
}

fn settings(max_step_fraction: f64) -> DefaultSettings<f64> {
    DefaultSettingsBuilder::default()
        .verbose(false)
        .max_step_fraction(max_step_fraction)
        .presolve_enable(false)
        .input_sparse_dropzeros(false)
        .equilibrate_enable(false)
        .iterative_refinement_enable(false)
        .tol_gap_abs(TOLERANCE)
        .tol_gap_rel(TOLERANCE)
        .tol_feas(TOLERANCE)
        .max_iter(50)
        .max_threads(1)
        .build()
        .expect("the settings are in range")
}
