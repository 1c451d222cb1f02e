//! Where rows of tasks, rows of limits and a box of motions meet.
use super::joint_bounds::{Bound, JointBounds};
use super::{LimitRows, TaskRows};
use handeye_solvers::{Constraint as Of, Qp, QpEnd, QuadraticProgram};
use nalgebra::{DMatrix, DVector};

/// Finds motions from rows; kept from step to step. `Send`.
///
/// It knows neither what moves nor where rows come from: a rig, as for [`super::Stepper`], or an estimated Jacobian.
pub struct MotionSolver {
    /// Share of the squared errors by which H is damped, (1 rad or 1 m)⁻²: where errors are large or the arm is near a singularity,
    /// motions are shorter; near the goal, whole Gauss-Newton steps. 0 takes whole steps always.
    pub damping: f64,
    /// J by columns, and what is wanted of each row.
    columns: Vec<f64>,
    wanted: Vec<f64>,
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    program: QuadraticProgram,
    /// Programs of the lower priorities, found by their shape.
    lower: Vec<QuadraticProgram>,
    step: Step,
}

/// A motion, and what it is worth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// Motion of every joint, or whatever else moves [rad or m]: finite, and inside its bounds.
    pub motion: Vec<f64>,
    /// Of every priority in turn, the root of the sum of the squared errors over their standard deviations: now, and as predicted.
    pub errors: Vec<[f64; 2]>,
    /// What holds the motion back.
    pub active: Vec<Active>,
    /// Where a limit gave way: constraints that cannot all hold, though without any one of them the others can. Other such sets may
    /// exist beside it.
    pub conflict: Vec<Constraint>,
    /// True where numbers were not finite or the program broke down. The motion is 0, or leads back inside the limits; controllers hold the
    /// robot then.
    pub failed: bool,
}

/// A constraint that holds a motion back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Active {
    /// Which.
    pub constraint: Constraint,
    /// How much the cost of the priority that it holds back would fall per unit that it were wider.
    pub multiplier: f64,
    /// How far it gave way, in its own unit; 0 where it holds.
    pub slack: f64,
}

/// Names a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constraint {
    /// A joint's own bound.
    Joint {
        /// Index of the joint.
        joint: usize,
        /// Which bound.
        bound: Bound,
        /// True where it may not move up, false where it may not move down.
        upper: bool,
    },
    /// A row of a limit.
    Limit {
        /// Index of the limit in the list that was given.
        limit: usize,
        /// Its row.
        row: usize,
    },
}

/// Rows of one priority, and what holds the motion back.
#[derive(Clone, Copy)]
struct Given<'a> {
    tasks: &'a TaskRows,
    limits: &'a LimitRows,
    bounds: &'a JointBounds,
}

/// Least damping, as a share of the largest diagonal entry of H.
const LEAST: f64 = 1e-12;

/// A direction whose rows are below this share of the largest is left open by a priority.
const OPEN: f64 = 1e-6;

impl MotionSolver {
    /// `damping`: see [`MotionSolver::damping`].
    pub fn new(damping: f64) -> Self {
        MotionSolver {
            damping,
            columns: Vec::new(),
            wanted: Vec::new(),
            hessian: Vec::new(),
            gradient: Vec::new(),
            program: QuadraticProgram::new(0, 0),
            lower: Vec::new(),
            step: Step::default(),
        }
    }

    /// The motion inside its bounds that leads best towards what the rows of `tasks` want.
    ///
    /// `tasks`: one entry per priority, the highest first; a lower one moves only in what those before it leave open. Limits give way
    /// where they cannot hold, the weakest first, and [`Step::active`] says which and how far; the bounds never give way. Where nothing
    /// holds it back, it is the damped Gauss-Newton step, exactly.
    pub fn solve(&mut self, tasks: &[TaskRows], limits: &LimitRows, bounds: &JointBounds) -> &Step {
        let n = bounds.lower.len();
        self.stand_still(n);
        // Without any task, limits and bounds may still ask for a motion.
        let none = [TaskRows::default()];
        let tasks = if tasks.is_empty() { &none } else { tasks };
        let mut open: Option<DMatrix<f64>> = None;
        for (priority, rows) in tasks.iter().enumerate() {
            let given = Given { tasks: rows, limits, bounds };
            match &open {
                None => self.first(n, &given),
                Some(basis) => self.further(n, &given, basis),
            }
            self.step.errors.push([rows.errors().sqrt(), rows.cost(&self.step.motion).sqrt()]);
            if self.step.failed || priority + 1 == tasks.len() {
                break;
            }
            let left = left_open(n, rows, open);
            if left.ncols() == 0 {
                break;
            }
            open = Some(left);
        }
        &self.step
    }

    /// No motion at all, for numbers that say nothing.
    pub(super) fn refuse(&mut self, n: usize) -> &Step {
        self.stand_still(n);
        self.step.failed = true;
        &self.step
    }

    fn stand_still(&mut self, n: usize) {
        self.step.motion.clear();
        self.step.motion.resize(n, 0.0);
        self.step.errors.clear();
        self.step.active.clear();
        self.step.conflict.clear();
        self.step.failed = false;
    }

    /// Of the highest priority: over the joints, in their box.
    fn first(&mut self, n: usize, given: &Given<'_>) {
        let Given { tasks, limits, bounds } = *given;
        self.normal_equations(n, tasks);
        let m = limits.len();
        if self.program.shape() != (n, m) {
            self.program = QuadraticProgram::new(n, m);
        }
        let found = self.program.solve(&Qp {
            hessian: &self.hessian,
            gradient: &self.gradient,
            lower: &bounds.lower,
            upper: &bounds.upper,
            rows: &limits.rows,
            bounds: &limits.bounds,
            strengths: &limits.strengths,
        });
        self.step.motion.copy_from_slice(&found.x);
        self.step.failed = found.end == QpEnd::Failed;
        for (joint, &multiplier) in found.of_box.iter().enumerate().filter(|(_, multiplier)| **multiplier != 0.0) {
            self.step.active.push(held(joint_bound(bounds, joint, multiplier > 0.0), multiplier.abs()));
        }
        for (i, &(limit, row)) in limits.of.iter().enumerate() {
            let (multiplier, slack) = (found.of_rows[i], found.slack[i]);
            if multiplier > 0.0 || slack > 0.0 {
                self.step.active.push(Active { constraint: Constraint::Limit { limit, row }, multiplier, slack });
            }
        }
        self.step.conflict.extend(found.conflict.iter().map(|constraint| match *constraint {
            Of::Upper(joint) => joint_bound(bounds, joint, true),
            Of::Lower(joint) => joint_bound(bounds, joint, false),
            Of::Row(i) => Constraint::Limit { limit: limits.of[i].0, row: limits.of[i].1 },
        }));
    }

    /// Of a lower priority: the motion so far plus B z, with the box as rows.
    fn further(&mut self, n: usize, given: &Given<'_>, basis: &DMatrix<f64>) {
        let Given { tasks, limits, bounds } = *given;
        self.normal_equations(n, tasks);
        let (hessian, k) = (DMatrix::from_row_slice(n, n, &self.hessian), basis.ncols());
        let so_far = DVector::from_column_slice(&self.step.motion);
        let gradient = DVector::from_column_slice(&self.gradient) + &hessian * &so_far;
        let m = limits.len();
        let mut all = DMatrix::zeros(2 * n + m, n);
        let mut room = DVector::zeros(2 * n + m);
        for i in 0..n {
            (all[(i, i)], all[(n + i, i)]) = (1.0, -1.0);
            room[i] = bounds.upper[i] - so_far[i];
            room[n + i] = so_far[i] - bounds.lower[i];
        }
        for i in 0..m {
            let row = &limits.rows[i * n..(i + 1) * n];
            all.row_mut(2 * n + i).copy_from_slice(row);
            let used: f64 = row.iter().zip(so_far.iter()).map(|(slope, step)| slope * step).sum();
            room[2 * n + i] = limits.bounds[i] - used;
        }
        // What the higher priorities could not hold stays as it is.
        room.iter_mut().for_each(|room| *room = room.max(0.0));
        let (reduced, slope) = (basis.transpose() * &hessian * basis, basis.transpose() * gradient);
        let rows: Vec<f64> = (&all * basis).transpose().as_slice().to_vec();
        let shape = (k, 2 * n + m);
        let place = self.lower.iter().position(|program| program.shape() == shape).unwrap_or_else(|| {
            self.lower.push(QuadraticProgram::new(shape.0, shape.1));
            self.lower.len() - 1
        });
        let found = self.lower[place].solve(&Qp {
            hessian: reduced.as_slice(),
            gradient: slope.as_slice(),
            lower: &vec![f64::NEG_INFINITY; k],
            upper: &vec![f64::INFINITY; k],
            rows: &rows,
            bounds: room.as_slice(),
            strengths: &vec![100.0; shape.1],
        });
        self.step.failed |= found.end == QpEnd::Failed;
        let motion = so_far + basis * DVector::from_column_slice(&found.x);
        for (i, motion) in motion.iter().enumerate() {
            self.step.motion[i] = motion.min(bounds.upper[i]).max(bounds.lower[i]);
        }
        for (i, &multiplier) in found.of_rows.iter().enumerate().filter(|(_, multiplier)| **multiplier > 0.0) {
            let constraint = if i < 2 * n {
                joint_bound(bounds, i % n, i < n)
            } else {
                let (limit, row) = limits.of[i - 2 * n];
                Constraint::Limit { limit, row }
            };
            self.step.active.push(held(constraint, multiplier));
        }
    }

    /// H = Jᵀ J + δ I and g = -Jᵀ e of the tasks' rows.
    fn normal_equations(&mut self, n: usize, tasks: &TaskRows) {
        let m = tasks.len();
        self.wanted.clear();
        self.wanted.extend((0..m).map(|row| tasks.wanted(row)));
        self.columns.clear();
        (0..n).for_each(|joint| self.columns.extend(tasks.column(joint)));
        self.hessian.clear();
        self.hessian.resize(n * n, 0.0);
        self.gradient.clear();
        for i in 0..n {
            let column = &self.columns[i * m..(i + 1) * m];
            self.gradient.push(-long_dot(column, &self.wanted));
            for j in 0..=i {
                self.hessian[i * n + j] = long_dot(column, &self.columns[j * m..(j + 1) * m]);
            }
        }
        let largest = (0..n).map(|i| self.hessian[i * n + i]).fold(0.0, f64::max);
        let damping = self.damping * tasks.errors() / m.max(1) as f64 + LEAST * largest;
        for i in 0..n {
            self.hessian[i * n + i] += damping.max(f64::MIN_POSITIVE.sqrt());
            for j in 0..i {
                self.hessian[j * n + i] = self.hessian[i * n + j];
            }
        }
    }
}

/// An orthonormal basis of the motions that the priorities so far leave open.
fn left_open(n: usize, tasks: &TaskRows, before: Option<DMatrix<f64>>) -> DMatrix<f64> {
    let before = before.unwrap_or_else(|| DMatrix::identity(n, n));
    let k = before.ncols();
    let mut square = DMatrix::zeros(n, n);
    for index in 0..tasks.len() {
        let row = DVector::from_column_slice(tasks.row(index).0);
        square.ger(1.0, &row, &row, 1.0);
    }
    let eigen = (before.transpose() * square * &before).symmetric_eigen();
    let largest = eigen.eigenvalues.iter().fold(0.0, |most: f64, value| most.max(*value));
    let open: Vec<usize> = (0..k).filter(|i| eigen.eigenvalues[*i] <= OPEN * OPEN * largest).collect();
    before * eigen.eigenvectors.select_columns(&open)
}

/// In four sums side by side, which a processor adds to at once.
fn long_dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, rest), (b, others)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        (0..4).for_each(|k| sums[k] += a[k] * b[k]);
    }
    sums.iter().sum::<f64>() + rest.iter().zip(others).map(|(a, b)| a * b).sum::<f64>()
}

fn joint_bound(bounds: &JointBounds, joint: usize, upper: bool) -> Constraint {
    let bound = if upper { bounds.of_upper[joint] } else { bounds.of_lower[joint] };
    Constraint::Joint { joint, bound, upper }
}

fn held(constraint: Constraint, multiplier: f64) -> Active {
    Active { constraint, multiplier, slack: 0.0 }
}
