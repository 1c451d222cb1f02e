//! Walks along free motions: which solved placements belong together.
use super::problem::Problem;
use handeye_solvers::Pose;
use nalgebra::{DVector, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Longest step [rad, sizes of the hand].
const STEP: f64 = 0.3;

/// Motions shorter than this arrive.
const ARRIVED: f64 = 1e-3;

/// Steps of a walk.
const STEPS: usize = 120;

/// Detours that are tried where the straight way ends, and their steps.
const DETOURS: [usize; 2] = [8, 6];

/// How a walk ended.
pub(super) struct Walk {
    pub arrived: bool,
    /// As near to the goal as it came.
    pub pose: Pose,
}

/// Walks from a solved placement towards another, through solved placements alone and always nearer.
pub(super) fn walk(problem: &Problem, from: &Pose, goal: &Pose) -> Walk {
    let mut pose = *from;
    let mut left = problem.difference(&pose, goal);
    for _ in 0..STEPS {
        if left.norm() < ARRIVED {
            return Walk { arrived: true, pose };
        }
        let along = project(problem, &pose, &left);
        if along.norm() < 1e-4 * left.norm() {
            break;
        }
        let mut length = along.norm().min(STEP);
        let next = loop {
            let found = stepped(problem, &pose, &(along.normalize() * length));
            let found = found.map(|next| (next, problem.difference(&next, goal)));
            match found.filter(|(_, rest)| rest.norm() < left.norm() * (1.0 - 1e-6)) {
                Some(next) => break Some(next),
                None if length < 0.02 * STEP.min(along.norm()) => break None,
                None => length *= 0.4,
            }
        };
        let Some(next) = next else { break };
        (pose, left) = next;
    }
    Walk { arrived: left.norm() < ARRIVED, pose }
}

/// True where a walk with detours gets from one to the other.
pub(super) fn are_connected(problem: &Problem, from: &Pose, goal: &Pose) -> bool {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let nearest = walk(problem, from, goal);
    let detour = |random: &mut ChaCha8Rng| {
        let direction = Vector6::from_fn(|_, _| random.random_range(-1.0..1.0));
        let begin = if random.random_bool(0.5) { nearest.pose } else { *from };
        (0..DETOURS[1]).fold(begin, |pose, _| {
            let along = project(problem, &pose, &direction);
            let step = along.try_normalize(1e-9).and_then(|along| stepped(problem, &pose, &(along * STEP)));
            step.unwrap_or(pose)
        })
    };
    nearest.arrived || (0..DETOURS[0]).any(|_| walk(problem, &detour(&mut random), goal).arrived)
}

/// The part of a motion that is free.
fn project(problem: &Problem, pose: &Pose, motion: &Vector6<f64>) -> Vector6<f64> {
    let basis = problem.null(pose).basis;
    let along = &basis * (basis.transpose() * DVector::from_column_slice(motion.as_slice()));
    along.fixed_rows::<6>(0).into_owned()
}

/// The solved placement beside the end of a free motion.
fn stepped(problem: &Problem, pose: &Pose, motion: &Vector6<f64>) -> Option<Pose> {
    let settled = problem.settle(&problem.moved(pose, motion), 20)?;
    let is_beside = problem.difference(pose, &settled.pose).norm() < 2.0 * motion.norm();
    (is_beside && problem.is_solved(&settled)).then_some(settled.pose)
}
