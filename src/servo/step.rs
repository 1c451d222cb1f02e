//! One step of a rig: rows gathered from tasks and limits, and the motion that meets them.
use super::motion_solver::{MotionSolver, Step};
use super::{Arm, Configuration, JointBounds, Limit, LimitRows, Task, TaskRows};

/// Finds motions of a rig; kept from step to step. `Send`.
pub struct Stepper {
    solver: MotionSolver,
    bounds: JointBounds,
    /// One entry per priority; those beyond the goals of a step are kept for the next.
    tasks: Vec<TaskRows>,
    limits: LimitRows,
}

/// A task and how strictly it comes before others.
#[derive(Clone, Copy)]
pub struct Goal<'a> {
    /// The task.
    pub task: &'a dyn Task,
    /// 0 comes first. A goal moves only in what those of smaller numbers leave open; of one number, goals share by their standard
    /// deviations.
    pub priority: usize,
    /// Share of the error that a step shall take away, in (0, 1]. 1 arrives with one step where nothing holds it back. A loop whose
    /// joints cannot stop at once wants 1 - exp(-r dt): errors fall by the rate r [1/s], and the last of them slowly.
    pub share: f64,
}

impl<'a> Goal<'a> {
    /// To be reached at once, before all others.
    pub fn new(task: &'a dyn Task) -> Self {
        Goal { task, priority: 0, share: 1.0 }
    }
}

impl Default for Stepper {
    /// With a damping of 1e-3.
    fn default() -> Self {
        Stepper::new(1e-3)
    }
}

impl Stepper {
    /// `damping`: see [`MotionSolver::damping`]; 0 takes whole Gauss-Newton steps.
    pub fn new(damping: f64) -> Self {
        Stepper {
            solver: MotionSolver::new(damping),
            bounds: JointBounds::default(),
            tasks: Vec::new(),
            limits: LimitRows::default(),
        }
    }

    /// The motion of the next `dt` seconds that leads best towards the goals.
    ///
    /// It always is finite and inside the joints' bounds; from outside their range it leads back or stands still. See
    /// [`MotionSolver::solve`].
    pub fn step(&mut self, arm: &Arm, at: &Configuration, goals: &[Goal<'_>], limits: &[&dyn Limit], dt: f64) -> &Step {
        let n = arm.joints();
        if !is_usable(at, n, dt) {
            return self.solver.refuse(n);
        }
        self.bounds.update(arm.limits(), &at.joints, &at.velocity, dt);
        self.limits.clear(n);
        for (index, limit) in limits.iter().enumerate() {
            self.limits.begin(index);
            limit.rows(arm, at, dt, &mut self.limits);
        }
        let priorities = self.gather(arm, at, goals);
        self.solver.solve(&self.tasks[..priorities], &self.limits, &self.bounds)
    }

    /// Rows of every priority in turn; the number of priorities.
    fn gather(&mut self, arm: &Arm, at: &Configuration, goals: &[Goal<'_>]) -> usize {
        let mut priorities = 0;
        let mut next = goals.iter().map(|goal| goal.priority).min();
        while let Some(priority) = next {
            if priorities == self.tasks.len() {
                self.tasks.push(TaskRows::default());
            }
            let tasks = &mut self.tasks[priorities];
            tasks.clear(arm.joints());
            for goal in goals.iter().filter(|goal| goal.priority == priority) {
                let first = tasks.len();
                goal.task.rows(arm, at, tasks);
                tasks.share(first, goal.share);
            }
            priorities += 1;
            next = goals.iter().map(|goal| goal.priority).filter(|other| *other > priority).min();
        }
        priorities
    }
}

/// A configuration of `n` finite joints.
fn is_usable(at: &Configuration, n: usize, dt: f64) -> bool {
    let finite = |list: &[f64]| list.len() == n && list.iter().all(|number| number.is_finite());
    finite(&at.joints) && finite(&at.velocity) && dt > 0.0 && dt.is_finite()
}
