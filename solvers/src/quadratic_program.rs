//! Small quadratic programs with a hard box and rows that may give way, for control loops.
use super::active_set::{ActiveSet, Outcome};
use super::elastic::Elastic;

/// Minimises
///
///   ½ xᵀ H x + gᵀ x + Σ ρᵢ sᵢ   subject to   lower ≤ x ≤ upper,   aᵢ·x ≤ bᵢ + sᵢ,   sᵢ ≥ 0,
///
/// H positive definite. The box is hard; a row gives way by its slack s only where the box and the other rows leave no other way, rows
/// of smaller strength first.
///
/// Where the unconstrained minimum satisfies everything, it is the answer. Otherwise an active set finds the minimum under all
/// constraints, exactly, or which of them cannot all hold. Only then Clarabel is asked where the rows shall give way, with ρ so large that
/// no more slack is taken than is needed (an exact penalty).
pub struct QuadraticProgram {
    n: usize,
    m: usize,
    /// L of H = L Lᵀ, by rows.
    factor: Vec<f64>,
    /// Units of the unknowns: half the widths of the box.
    scale: Vec<f64>,
    active_set: ActiveSet,
    /// Rows that can be violated inside the box.
    in_reach: Vec<usize>,
    /// By numbers of rows, each set up when it is first needed.
    elastic: Vec<Elastic>,
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

/// A constraint of a [`Qp`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Constraint {
    /// x of this index is at most its upper bound.
    Upper(usize),
    /// x of this index is at least its lower bound.
    Lower(usize),
    /// The row of this index.
    Row(usize),
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
    /// Where rows had to give way: constraints that cannot all hold, though without any one of them the others can. There may be
    /// other such sets.
    pub conflict: Vec<Constraint>,
    /// How it ended.
    pub end: QpEnd,
    /// Iterations of Clarabel; 0 where it was not asked.
    pub iterations: u32,
}

/// Violations below this are rounding, in units of the box.
const ROUNDING: f64 = 1e-7;

/// Clarabel is set up for multiples of so many rows.
const ROWS: usize = 4;

impl QuadraticProgram {
    /// For `n` unknowns and `m` rows.
    pub fn new(n: usize, m: usize) -> Self {
        let solution = QpSolution {
            x: vec![0.0; n],
            of_box: vec![0.0; n],
            of_rows: vec![0.0; m],
            slack: vec![0.0; m],
            ..QpSolution::default()
        };
        let (factor, scale, in_reach, elastic) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        QuadraticProgram { n, m, factor, scale, active_set: ActiveSet::default(), in_reach, elastic, solution }
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
        self.solution.conflict.clear();
        self.solution.iterations = 0;
        self.solution.end = if !is_usable(qp) || !self.unconstrained(qp) {
            QpEnd::Failed
        } else if satisfies(&self.solution.x, qp) {
            QpEnd::Free
        } else {
            self.constrained(qp)
        };
        if self.solution.end == QpEnd::Failed {
            let box_of = qp.lower.iter().zip(qp.upper);
            self.solution.x.iter_mut().zip(box_of).for_each(|(x, (&lower, &upper))| *x = inside(0.0, lower, upper));
        }
        &self.solution
    }

    /// x = -H⁻¹ g; false where H is not positive definite.
    fn unconstrained(&mut self, qp: &Qp<'_>) -> bool {
        let (n, factor, x) = (self.n, &mut self.factor, &mut self.solution.x);
        factor.clear();
        factor.extend_from_slice(qp.hessian);
        for i in 0..n {
            for j in 0..=i {
                let rest = qp.hessian[i * n + j] - dot(&factor[i * n..i * n + j], &factor[j * n..j * n + j]);
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
            x[i] = (-qp.gradient[i] - dot(&factor[i * n..i * n + i], &x[..i])) / factor[i * n + i];
        }
        for i in (0..n).rev() {
            let inner: f64 = (i + 1..n).map(|k| factor[k * n + i] * x[k]).sum();
            x[i] = (x[i] - inner) / factor[i * n + i];
        }
        x.iter().all(|x| x.is_finite())
    }

    fn constrained(&mut self, qp: &Qp<'_>) -> QpEnd {
        self.measure(qp);
        let QuadraticProgram { n, factor, scale, active_set, solution, .. } = self;
        let outcome = active_set.solve(qp, factor, &solution.x, scale);
        if outcome != Outcome::Found {
            return self.give_way(qp, outcome);
        }
        for i in 0..*n {
            solution.x[i] = inside(active_set.x[i], qp.lower[i], qp.upper[i]);
        }
        for (constraint, multiplier) in active_set.active() {
            match constraint {
                Constraint::Upper(i) => solution.of_box[i] += multiplier,
                Constraint::Lower(i) => solution.of_box[i] -= multiplier,
                Constraint::Row(i) => solution.of_rows[i] = multiplier,
            }
        }
        QpEnd::Constrained
    }

    /// Where the rows cannot all hold: a minimum where some give way.
    fn give_way(&mut self, qp: &Qp<'_>, outcome: Outcome) -> QpEnd {
        let (n, m) = (self.n, self.m);
        self.in_reach.clear();
        self.in_reach.extend((0..m).filter(|&i| {
            let farthest = |(k, &a): (usize, &f64)| match a {
                _ if a > 0.0 => a * qp.upper[k].max(qp.lower[k]),
                _ if a < 0.0 => a * qp.lower[k],
                _ => 0.0,
            };
            qp.rows[i * n..(i + 1) * n].iter().enumerate().map(farthest).sum::<f64>() > qp.bounds[i]
        }));
        let size = self.in_reach.len().next_multiple_of(ROWS).min(m);
        let place = self.elastic.iter().position(|elastic| elastic.rows() == size).unwrap_or_else(|| {
            self.elastic.push(Elastic::new(n, size));
            self.elastic.len() - 1
        });
        let elastic = &mut self.elastic[place];
        let arrived = elastic.solve(qp, &self.in_reach, &self.scale);
        self.solution.iterations = elastic.iterations;
        if !arrived {
            return QpEnd::Failed;
        }
        self.solution.x.copy_from_slice(&elastic.x);
        self.solution.of_box.copy_from_slice(&elastic.of_box);
        for (&row, &multiplier) in self.in_reach.iter().zip(&elastic.of_rows) {
            let slopes = &qp.rows[row * n..(row + 1) * n];
            let length = slopes.iter().zip(&self.scale).map(|(a, d)| (a * d) * (a * d)).sum::<f64>().sqrt();
            let violation = dot(slopes, &self.solution.x) - qp.bounds[row];
            self.solution.slack[row] = if violation > ROUNDING * length { violation } else { 0.0 };
            self.solution.of_rows[row] = multiplier;
        }
        if outcome == Outcome::Conflict && self.solution.slack.iter().any(|slack| *slack > 0.0) {
            self.solution.conflict.extend_from_slice(&self.active_set.conflict);
            self.solution.conflict.sort_unstable();
        }
        QpEnd::Constrained
    }

    /// Half the widths of the box; where there is none, or next to none beside the others, the widest.
    fn measure(&mut self, qp: &Qp<'_>) {
        let widths = qp.lower.iter().zip(qp.upper).map(|(lower, upper)| 0.5 * (upper - lower));
        let widest = widths.clone().filter(|width| width.is_finite()).fold(0.0, f64::max);
        let usual = if widest > 0.0 { widest } else { 1.0 };
        let unit = |width: f64| if width.is_finite() && width > 1e-3 * usual { width } else { usual };
        self.scale.clear();
        self.scale.extend(widths.map(unit));
    }
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

#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The nearest number of an interval, whose upper end counts as the lower where it is below; 0 where a bound is NaN.
pub(crate) fn inside(x: f64, lower: f64, upper: f64) -> f64 {
    if lower.is_nan() || upper.is_nan() { 0.0 } else { x.min(upper).max(lower) }
}
