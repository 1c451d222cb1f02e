//! Inverse kinematics: the pose of the tip to joints, inside their limits.
use super::joint_box::JointBox;
use super::pose_error::PoseError;
use super::starts::Starts;
use crate::Error;
use crate::chain::JointChain;
use crate::rig::{Model, Rig};
use handeye_solvers::Pose;

/// How inverse kinematics searches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseOptions {
    /// Largest distance of the tip from the pose that counts as reached [m].
    pub xyz: f64,
    /// Largest angle of the tip to the pose that counts as reached [rad].
    pub rot: f64,
    /// Where a pose is out of reach, what is closest depends on the distance that weighs as much as a radian [m].
    pub metres_per_radian: f64,
    /// Starts that are tried before a pose counts as out of reach, and by [`InverseKinematics::branches`].
    pub starts: usize,
    /// Shifts the starts: the same seed gives the same solution.
    pub seed: u64,
}

impl Default for InverseOptions {
    fn default() -> Self {
        InverseOptions { xyz: 1e-7, rot: 1e-7, metres_per_radian: 0.3, starts: 100, seed: 1 }
    }
}

/// Joints for a pose of the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// One reading per joint, inside its limits [rad or m].
    pub joints: Vec<f64>,
    /// Distance of the tip from the pose [m].
    pub xyz: f64,
    /// Angle of the tip to the pose [rad].
    pub rot: f64,
    /// False where the pose is out of reach: then these are the closest joints that were found.
    pub reached: bool,
    /// Starts that were tried.
    pub starts: usize,
}

/// Inverse kinematics of an arm of any number of joints, prepared once.
///
/// Damped Gauss-Newton steps, each a quadratic program in the box of the limits, from the joints that are given and then from
/// starts that fill the limits evenly. A joint that can turn all the way round is not bounded on the way.
#[derive(Clone, Debug)]
pub struct InverseKinematics {
    pub(super) options: InverseOptions,
    pub(super) chain: JointChain,
    pub(super) limits: JointBox,
    pub(super) error: PoseError,
    pub(super) joints: Vec<f64>,
    pub(super) trial: Vec<f64>,
}

/// Damping per squared error (Chan and Lawrence 1988): short steps far away and at singularities, quadratic convergence near the
/// solution.
const DAMPING: f64 = 0.3;

/// Least damping, which decides where the pose leaves joints open.
const LEAST_DAMPING: f64 = 1e-12;

/// Iterations from one start; arms with a solution near it need 5 to 10.
const ITERATIONS: usize = 30;

/// A start is given up where this many iterations have not halved the cost.
const PATIENCE: usize = 4;

/// Starts without a new branch after which they are likely to be all, and how many more per branch: a UR5 that turns all the way round
/// then has the true one among them in 998 of 1,000 samples.
const IDLE: [usize; 2] = [8, 2];

/// Longest motion of a joint in an iteration [rad or m].
pub(super) const LONGEST: f64 = 1.0;

/// Starts that ended closest to a pose out of reach, from which closer joints are looked for.
const CANDIDATES: usize = 16;

impl InverseKinematics {
    /// Of the arm of a rig, whose every joint has its parameters; cameras and features are not needed.
    ///
    /// Errors: [`Error::Unusable`] where a parameter is missing, or the rig has no joints.
    pub fn new(rig: &Rig, options: InverseOptions) -> Result<Self, Error> {
        if rig.robot.joints.is_empty() {
            return Err(Error::Unusable("the rig has no joints: inverse kinematics needs a chain".to_owned()));
        }
        let arm = Rig { robot: rig.robot.clone(), ..Rig::default() };
        Ok(InverseKinematics {
            options,
            chain: Model::new(&arm)?.joint_chain(),
            limits: JointBox::new(rig),
            error: PoseError::default(),
            joints: Vec::new(),
            trial: Vec::new(),
        })
    }

    /// The chain, whose parameters are the rig's.
    pub fn chain(&self) -> &JointChain {
        &self.chain
    }

    /// Joints that bring the tip to a pose, from `near`: the first that reach it, or else the closest that were found.
    ///
    /// `near`: one reading per joint, where the search begins; a reading that is missing or not finite counts as 0.
    pub fn solve(&mut self, world_from_tip: &Pose, near: &[f64]) -> Reached {
        let mut starts = Starts::new(self.chain.len(), self.options.seed);
        let near = self.begin(near);
        let mut closest: Vec<(f64, Vec<f64>)> = Vec::new();
        for tried in 1..=self.options.starts.max(1) {
            if tried > 1 {
                starts.next(&self.limits, &mut self.joints);
            }
            let Some(cost) = self.search(world_from_tip) else {
                return self.reached(&near, world_from_tip, tried);
            };
            let place = closest.partition_point(|(other, _)| *other <= cost);
            if place < CANDIDATES {
                closest.insert(place, (cost, self.joints.clone()));
                closest.truncate(CANDIDATES);
            }
        }
        for (cost, joints) in &mut closest {
            std::mem::swap(&mut self.joints, joints);
            *cost = self.approach(world_from_tip);
            std::mem::swap(&mut self.joints, joints);
        }
        if let Some((_, joints)) = closest.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
            self.joints = joints;
        }
        self.reached(&near, world_from_tip, self.options.starts.max(1))
    }

    /// All branches: joints that reach a pose and are not a turn by 2π apart, nearest to `near` first; empty where it is out of reach.
    ///
    /// From `near` and all [`InverseOptions::starts`], at most [`InverseKinematics::BRANCHES`]. An arm of more than six joints reaches a
    /// pose along curves; of every curve that is found, the points nearest to `near` stand for it.
    pub fn branches(&mut self, world_from_tip: &Pose, near: &[f64]) -> Vec<Reached> {
        let near = self.begin(near);
        let mut found = self.collect(world_from_tip, &near, |_, _| false);
        let distance = |reached: &Reached| {
            reached.joints.iter().zip(&near).map(|(joint, near)| (joint - near).powi(2)).sum::<f64>()
        };
        found.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        found
    }

    /// Branches in the order in which they are found, within a tolerance [m, rad] of the pose, until they are likely to be all.
    pub(super) fn likely_branches(&mut self, target: &Pose, near: &[f64], (xyz, rot): (f64, f64)) -> Vec<Reached> {
        let near = self.begin(near);
        let exact = self.options;
        (self.options.xyz, self.options.rot) = (xyz, rot);
        let found = self.collect(target, &near, |found, idle| idle >= IDLE[0] + IDLE[1] * found);
        self.options = exact;
        found
    }

    /// Branches until `enough` of (how many were found, starts since the last one).
    fn collect(&mut self, target: &Pose, near: &[f64], enough: impl Fn(usize, usize) -> bool) -> Vec<Reached> {
        let mut starts = Starts::new(self.chain.len(), self.options.seed);
        let (mut found, mut idle): (Vec<Reached>, usize) = (Vec::new(), 0);
        for tried in 1..=self.options.starts.max(1) {
            if tried > 1 {
                starts.next(&self.limits, &mut self.joints);
            }
            idle += 1;
            if self.search(target).is_none() && self.settle(target, near) {
                let reached = self.reached(near, target, tried);
                let is_new = |other: &Reached| self.limits.distance(&other.joints, &reached.joints) > self.apart();
                if reached.reached && found.iter().all(is_new) {
                    found.push(reached);
                    idle = 0;
                }
            }
            if found.len() == Self::BRANCHES || enough(found.len(), idle) {
                break;
            }
        }
        found
    }

    /// Most branches that are listed: six revolute joints have up to 16.
    pub const BRANCHES: usize = 16;

    /// Solutions with a smaller largest difference are one [rad or m]: an arm of seven joints settles to about a hundredth of that.
    fn apart(&self) -> f64 {
        if self.is_redundant() { 0.05 } else { (10.0 * self.options.rot).clamp(1e-3, 0.05) }
    }

    fn is_redundant(&self) -> bool {
        self.chain.len() > 6
    }

    /// Puts the joints where the search begins, and returns them.
    fn begin(&mut self, near: &[f64]) -> Vec<f64> {
        let reading = |i: usize| near.get(i).copied().filter(|reading| reading.is_finite()).unwrap_or(0.0);
        let near: Vec<f64> = (0..self.chain.len()).map(reading).collect();
        self.joints.clone_from(&near);
        self.limits.bring_inside(&mut self.joints, &near);
        near
    }

    /// `None` where the joints have come to reach the pose, or else the cost where they are.
    fn search(&mut self, target: &Pose) -> Option<f64> {
        let (mut mark, mut marked) = (f64::INFINITY, 0);
        let mut cost = f64::INFINITY;
        for iteration in 0..ITERATIONS {
            cost = self.error.look(&self.chain, target, &self.joints, self.options.metres_per_radian);
            if self.error.is_within(self.options.xyz, self.options.rot) {
                return None;
            }
            if cost < 0.5 * mark {
                (mark, marked) = (cost, iteration);
            } else if iteration - marked >= PATIENCE {
                return Some(cost);
            }
            let Some(step) = self.error.step(&self.limits, &self.joints, DAMPING * cost + LEAST_DAMPING, None) else {
                return Some(f64::INFINITY);
            };
            let longest = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
            let scale = if longest > LONGEST { LONGEST / longest } else { 1.0 };
            self.joints.iter_mut().zip(step).for_each(|(joint, s)| *joint += scale * s);
        }
        Some(cost)
    }

    /// Moves redundant joints along the curve of those that reach the pose, to where they are nearest to `near`. False where that
    /// leads off the curve.
    fn settle(&mut self, target: &Pose, near: &[f64]) -> bool {
        if !self.is_redundant() {
            return true;
        }
        let length = self.options.metres_per_radian;
        for _ in 0..ITERATIONS {
            self.error.look(&self.chain, target, &self.joints, length);
            let pull = Some((near, SETTLING));
            let Some(step) = self.error.step(&self.limits, &self.joints, LEAST_DAMPING, pull) else { return false };
            let longest = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
            let scale = if longest > LONGEST { LONGEST / longest } else { 1.0 };
            self.joints.iter_mut().zip(step).for_each(|(joint, s)| *joint += scale * s);
            if longest < 1e-4 {
                break;
            }
        }
        self.search(target).is_none()
    }

    fn reached(&mut self, near: &[f64], target: &Pose, starts: usize) -> Reached {
        let mut joints = self.joints.clone();
        self.limits.bring_inside(&mut joints, near);
        self.error.look(&self.chain, target, &joints, self.options.metres_per_radian);
        // Whole turns are not exact.
        let reached = self.error.is_within(1.01 * self.options.xyz + 1e-12, 1.01 * self.options.rot + 1e-12);
        Reached { joints, xyz: self.error.xyz(), rot: self.error.rot(), reached, starts }
    }
}

/// Weight of the pull towards `near` beside that of the pose.
const SETTLING: f64 = 1e-4;
