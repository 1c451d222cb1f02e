//! Small quadratic programs with a hard box and rows that may give way, for control loops.
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};

/// Minimises
///
///   ½ xᵀ H x + gᵀ x + Σ ρᵢ sᵢ   subject to   lower ≤ x ≤ upper,   aᵢ·x ≤ bᵢ + sᵢ,   sᵢ ≥ 0,
///
/// H positive definite. The box is hard; a row gives way by its slack s only where the box and the rows before it leave no other way
/// (an exact penalty), rows of smaller strength first. Of one shape for good, so that Clarabel is set up once and updated in place.
///
/// Where the unconstrained minimum satisfies everything, it is the answer, exactly, and Clarabel is not asked.
pub struct QuadraticProgram {
    n: usize,
    m: usize,
    solver: Option<DefaultSolver<f64>>,
    work: Work,
    solution: QpSolution,
}

/// A problem of the shape that its [`QuadraticProgram`] was made for.
#[derive(Clone, Copy, Debug)]
pub struct Qp<'a> {
    /// H by rows, n x n; its lower triangle counts.
    pub hessian: &'a [f64],
    /// g, n.
    pub gradient: &'a [f64],
    /// n; -∞ where there is none.
    pub lower: &'a [f64],
    /// n; ∞ where there is none. Below `lower` it counts as `lower`.
    pub upper: &'a [f64],
    /// a by rows, m x n.
    pub rows: &'a [f64],
    /// b, m; ∞ where a row is off.
    pub bounds: &'a [f64],
    /// m; in a conflict, a row gives way before those of greater strength. From 1 to 100.
    pub strengths: &'a [f64],
}

/// How a program ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum QpEnd {
    /// At the unconstrained minimum.
    #[default]
    Free,
    /// At a minimum with active constraints.
    Constrained,
    /// The numbers were not finite, H was not positive definite, or the solver did not arrive: x is the point of the box nearest to 0.
    Failed,
}

/// The answer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QpSolution {
    /// x, inside the box to the last bit.
    pub x: Vec<f64>,
    /// Multipliers of the box: positive where `upper` holds x back, negative where `lower` does.
    pub of_box: Vec<f64>,
    /// Multipliers of the rows, ≥ 0.
    pub of_rows: Vec<f64>,
    /// How far each row is violated.
    pub slack: Vec<f64>,
    /// How it ended.
    pub end: QpEnd,
    /// Iterations of the interior-point method; 0 where it was not asked.
    pub iterations: u32,
}

/// The scaled problem, as Clarabel has it: x = D y, cost divided by κ, rows divided by their norms.
#[derive(Default)]
struct Work {
    /// D.
    scale: Vec<f64>,
    factor: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    norms: Vec<f64>,
}

/// Price of a unit of a scaled row's violation, where no scaled gradient exceeds 1: more than the multipliers that avoid it.
const PRICE: f64 = 100.0;

/// A bound this far away is none, in units of the scaled step.
const FAR: f64 = 1e4;

/// Tolerances of Clarabel on the scaled problem: a step is right to a millionth of its box or better.
const TOLERANCE: f64 = 1e-9;

/// Scaled multipliers below this are zero.
const INACTIVE: f64 = 1e-5;

impl QuadraticProgram {
    /// For `n` unknowns and `m` rows. Clarabel is set up when it is first needed.
    pub fn new(n: usize, m: usize) -> Self {
        let solution = QpSolution {
            x: vec![0.0; n],
            of_box: vec![0.0; n],
            of_rows: vec![0.0; m],
            slack: vec![0.0; m],
            ..QpSolution::default()
        };
        QuadraticProgram { n, m, solver: None, work: Work::default(), solution }
    }

    /// Numbers of unknowns and of rows.
    pub fn shape(&self) -> (usize, usize) {
        (self.n, self.m)
    }

    /// Solves a problem. Panics where its slices are not of the program's shape.
    pub fn solve(&mut self, qp: &Qp<'_>) -> &QpSolution {
        let (n, m) = (self.n, self.m);
        assert!(qp.hessian.len() == n * n && qp.gradient.len() == n && qp.lower.len() == n && qp.upper.len() == n);
        assert!(qp.rows.len() == m * n && qp.bounds.len() == m && qp.strengths.len() == m);
        self.solution.of_box.fill(0.0);
        self.solution.of_rows.fill(0.0);
        self.solution.slack.fill(0.0);
        self.solution.iterations = 0;
        self.solution.end = if !is_usable(qp) || !self.unconstrained(qp) {
            self.nearest_to_zero(qp);
            QpEnd::Failed
        } else if satisfies(&self.solution.x, qp) {
            QpEnd::Free
        } else {
            self.constrained(qp)
        };
        &self.solution
    }

    /// x = -H⁻¹ g; false where H is not positive definite.
    fn unconstrained(&mut self, qp: &Qp<'_>) -> bool {
        let (n, factor, x) = (self.n, &mut self.work.factor, &mut self.solution.x);
        factor.clear();
        factor.extend_from_slice(qp.hessian);
        for i in 0..n {
            for j in 0..=i {
                let inner: f64 = (0..j).map(|k| factor[i * n + k] * factor[j * n + k]).sum();
                let rest = qp.hessian[i * n + j] - inner;
                if i == j {
                    if !(rest > 0.0 && rest.is_finite()) {
                        return false;
                    }
                    factor[i * n + i] = rest.sqrt();
                } else {
                    factor[i * n + j] = rest / factor[j * n + j];
                }
            }
        }
        for i in 0..n {
            let inner: f64 = (0..i).map(|k| factor[i * n + k] * x[k]).sum();
            x[i] = (-qp.gradient[i] - inner) / factor[i * n + i];
        }
        for i in (0..n).rev() {
            let inner: f64 = (i + 1..n).map(|k| factor[k * n + i] * x[k]).sum();
            x[i] = (x[i] - inner) / factor[i * n + i];
        }
        x.iter().all(|x| x.is_finite())
    }

    fn nearest_to_zero(&mut self, qp: &Qp<'_>) {
        for ((x, &lower), &upper) in self.solution.x.iter_mut().zip(qp.lower).zip(qp.upper) {
            *x = inside(0.0, lower, upper);
        }
    }

    fn constrained(&mut self, qp: &Qp<'_>) -> QpEnd {
        let (n, m) = (self.n, self.m);
        let kappa = self.work.scaled(qp, n, m);
        let work = &self.work;
        let solver = match &mut self.solver {
            Some(solver) => {
                let updated = solver.update_P(&work.p).is_ok()
                    && solver.update_q(&work.q).is_ok()
                    && solver.update_A(&work.a).is_ok()
                    && solver.update_b(&work.b).is_ok();
                updated.then_some(solver)
            }
            none => set_up(work, n, m).map(|solver| none.insert(solver)),
        };
        let Some(solver) = solver else {
            self.nearest_to_zero(qp);
            return QpEnd::Failed;
        };
        solver.solve();
        let found = &solver.solution;
        let arrived = matches!(found.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        self.solution.iterations = found.iterations;
        if !(arrived && found.x.iter().chain(&found.z).all(|number| number.is_finite())) {
            self.nearest_to_zero(qp);
            return QpEnd::Failed;
        }
        let multiplier = |z: f64| if z > INACTIVE { z } else { 0.0 };
        for i in 0..n {
            self.solution.x[i] = inside(work.scale[i] * found.x[i], qp.lower[i], qp.upper[i]);
            self.solution.of_box[i] = (multiplier(found.z[i]) - multiplier(found.z[n + i])) * kappa / work.scale[i];
        }
        for i in 0..m {
            self.solution.of_rows[i] = multiplier(found.z[2 * n + i]) * kappa / work.norms[i];
            let row = &qp.rows[i * n..(i + 1) * n];
            let violation = dot(row, &self.solution.x) - qp.bounds[i];
            self.solution.slack[i] = if violation > 1e2 * TOLERANCE * work.norms[i] { violation } else { 0.0 };
        }
        QpEnd::Constrained
    }
}

impl Work {
    /// Fills in the scaled problem and returns κ. Unknowns of Clarabel: y, then slacks; its rows: upper, lower, rows, slacks ≥ 0.
    fn scaled(&mut self, qp: &Qp<'_>, n: usize, m: usize) -> f64 {
        self.scale.clear();
        let width = |i: usize| 0.5 * (qp.upper[i] - qp.lower[i]);
        let widest = (0..n).map(width).filter(|width| width.is_finite()).fold(0.0, f64::max);
        let usual = if widest > 0.0 { widest } else { 1.0 };
        self.scale
            .extend((0..n).map(|i| if width(i).is_finite() && width(i) > 1e-3 * usual { width(i) } else { usual }));
        let d = &self.scale;
        let trace: f64 = (0..n).map(|i| qp.hessian[i * n + i] * d[i] * d[i]).sum();
        let steepest = (0..n).map(|i| (qp.gradient[i] * d[i]).abs()).fold(0.0, f64::max);
        let kappa = (trace / n as f64).max(steepest);
        self.q.clear();
        self.q.extend((0..n).map(|i| qp.gradient[i] * d[i] / kappa));
        self.q.extend(qp.strengths.iter().map(|strength| strength.clamp(1.0, 100.0) * PRICE));
        // The upper triangle of P by columns, with a little curvature for each slack.
        self.p.clear();
        for j in 0..n {
            self.p.extend((0..=j).map(|i| qp.hessian[j * n + i] * d[i] * d[j] / kappa));
        }
        self.p.extend(std::iter::repeat_n(1.0, m));
        self.norms.clear();
        self.norms.extend((0..m).map(|i| {
            let row = &qp.rows[i * n..(i + 1) * n];
            row.iter().zip(d).map(|(a, d)| (a * d) * (a * d)).sum::<f64>().sqrt().max(1e-12)
        }));
        self.b.clear();
        let near = |bound: f64| bound.clamp(-FAR, FAR);
        self.b.extend((0..n).map(|i| near(qp.upper[i].max(qp.lower[i]) / d[i])));
        self.b.extend((0..n).map(|i| near(-qp.lower[i] / d[i])));
        self.b.extend((0..m).map(|i| near(qp.bounds[i] / self.norms[i])));
        self.b.extend(std::iter::repeat_n(0.0, m));
        self.a.clear();
        for (j, d) in d.iter().enumerate() {
            self.a.extend([1.0, -1.0]);
            self.a.extend((0..m).map(|i| qp.rows[i * n + j] * d / self.norms[i]));
        }
        self.a.extend(std::iter::repeat_n(-1.0, 2 * m));
        kappa
    }
}

/// Clarabel with the pattern of all problems of a shape.
fn set_up(work: &Work, n: usize, m: usize) -> Option<DefaultSolver<f64>> {
    let (mut columns, mut rows) = (vec![0], Vec::new());
    for j in 0..n {
        rows.extend(0..=j);
        columns.push(rows.len());
    }
    for i in 0..m {
        rows.push(n + i);
        columns.push(rows.len());
    }
    let p = CscMatrix::new(n + m, n + m, columns, rows, work.p.clone());
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
    let a = CscMatrix::new(2 * (n + m), n + m, columns, rows, work.a.clone());
    DefaultSolver::new(&p, &work.q, &a, &work.b, &[NonnegativeConeT(2 * (n + m))], settings()).ok()
}

fn settings() -> DefaultSettings<f64> {
    DefaultSettingsBuilder::default()
        .verbose(false)
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

fn is_usable(qp: &Qp<'_>) -> bool {
    let finite = |slice: &[f64]| slice.iter().all(|number| number.is_finite());
    let no_nan = |slice: &[f64]| !slice.iter().any(|number| number.is_nan());
    finite(qp.hessian)
        && finite(qp.gradient)
        && finite(qp.rows)
        && finite(qp.strengths)
        && no_nan(qp.lower)
        && no_nan(qp.upper)
        && no_nan(qp.bounds)
}

fn satisfies(x: &[f64], qp: &Qp<'_>) -> bool {
    let n = x.len();
    let in_box = (0..n).all(|i| qp.lower[i] <= x[i] && x[i] <= qp.upper[i]);
    in_box && qp.bounds.iter().enumerate().all(|(i, &bound)| dot(&qp.rows[i * n..(i + 1) * n], x) <= bound)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The nearest number of an interval, whose upper end counts as the lower where it is below; 0 where a bound is NaN.
fn inside(x: f64, lower: f64, upper: f64) -> f64 {
    if lower.is_nan() || upper.is_nan() { 0.0 } else { x.min(upper).max(lower) }
}
