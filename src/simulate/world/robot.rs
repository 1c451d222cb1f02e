//! How a simulated robot carries out commands: inexactly, and inside the limits of its joints.
use crate::Error;
use crate::chain::{JointChain, Posture};
use crate::geometry::between;
use crate::recording::Command;
use crate::rig::{Limits, PoseNoise, Rig};
use crate::simulate::measure::moved;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{DMatrix, DVector, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// How a robot errs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Execution {
    /// Standard deviation of every joint after a motion of the joints [rad or m].
    pub joints: f64,
    /// Standard deviation of the executed motion A of the tip, after a motion of the tip.
    pub pose: PoseNoise,
    /// Standard deviation in proportion to the motion, of each joint or of each coordinate of the tip's motion.
    pub share: f64,
    /// Motions of a joint that are smaller than this are not carried out [rad or m].
    pub dead_band: f64,
    /// Executed over commanded motion, one per joint; empty for exact ones.
    pub gain: Vec<f64>,
    /// Joints that others drag along.
    pub couplings: Vec<Coupling>,
}

/// A joint that another drags along, by a cable or a gear that they share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Index of the joint that is dragged along.
    pub joint: usize,
    /// Index of the joint that does so.
    pub by: usize,
    /// Motion of the one over that of the other, as far as both are from the ends of their limits.
    pub share: f64,
}

/// Longest turn [rad] and shift [m] between the poses that the tip passes on its way.
const TURN: f64 = 0.05;
const SHIFT: f64 = 0.02;

/// Iterations to each of them, and where they end [rad or m].
const ITERATIONS: usize = 50;
const ARRIVED: f64 = 1e-12;

pub(super) struct Robot {
    pub chain: JointChain,
    pub limits: Vec<Limits>,
    pub execution: Execution,
}

impl Robot {
    /// Joints after a command of `dt` seconds.
    ///
    /// Errors: [`Error::Unusable`] for a command of another number of joints, or with numbers that are not finite.
    pub fn execute(
        &self,
        joints: &[f64],
        command: &Command,
        dt: f64,
        random: &mut ChaCha8Rng,
    ) -> Result<Vec<f64>, Error> {
        if !command.is_finite() {
            return Err(Error::Unusable("a command with numbers that are not finite was refused".to_owned()));
        }
        let (numbers, from, scale) = match command {
            Command::Hold => return Ok(joints.to_vec()),
            Command::Joints(target) => (target, Some(joints), 1.0),
            Command::JointDelta(delta) => (delta, None, 1.0),
            Command::JointVelocity(velocity) => (velocity, None, dt),
            Command::PoseDelta(action) => return Ok(self.follow(joints, action, random)),
            Command::PoseVelocity(twist) => {
                let action = Command::along(twist, &self.chain.tip(joints), dt);
                return Ok(self.follow(joints, &action, random));
            }
        };
        if numbers.len() != self.chain.len() {
            return Err(Error::Unusable(format!(
                "a command of {} joints was refused, the robot has {}",
                numbers.len(),
                self.chain.len()
            )));
        }
        let motion = |(i, number): (usize, &f64)| scale * number - from.map_or(0.0, |joints| joints[i]);
        let motion: Vec<f64> = numbers.iter().enumerate().map(motion).collect();
        let mut normal = || random.sample::<f64, _>(StandardNormal);
        let noise = &self.execution;
        let moved = motion.iter().enumerate().map(|(i, motion)| {
            let gain = noise.gain.get(i).copied().unwrap_or(1.0);
            let motion = if motion.abs() < noise.dead_band { &0.0 } else { motion };
            joints[i] + gain * motion + noise.joints * normal() + noise.share * motion * normal()
        });
        let mut moved: Vec<f64> = moved.collect();
        // A joint drags others along as far as it moves itself, and none of them past its end.
        self.stop_at_ends(&mut moved);
        let mut after = moved.clone();
        for Coupling { joint, by, share } in &noise.couplings {
            after[*joint] += share * (moved[*by] - joints[*by]);
        }
        self.stop_at_ends(&mut after);
        Ok(after)
    }

    /// Moves the tip by A and its noise, as the robot's own controller would: as near as its joints allow.
    fn follow(&self, joints: &[f64], action: &Pose, random: &mut ChaCha8Rng) -> Vec<f64> {
        let noise = &self.execution;
        let turn = so3::log(&action.rotation).norm();
        let tip = self.chain.tip(joints);
        let shift = (action.transform(&tip.translation) - tip.translation).norm();
        let blur = |sd: f64, share: f64| sd.hypot(noise.share * share);
        let sd = PoseNoise { xyz: blur(noise.pose.xyz, shift), rot: blur(noise.pose.rot, turn) };
        let executed = moved(*action, sd, || random.sample::<f64, _>(StandardNormal));
        // By steps short enough that the joints stay on their branch.
        let target = executed * tip;
        let [turn, shift] = [tip.angle_to(&target), (target.translation - tip.translation).norm()];
        let steps = (turn / TURN).max(shift / SHIFT).ceil().clamp(1.0, 1e4);
        let (mut joints, mut posture) = (joints.to_vec(), Posture::default());
        for step in 1..=steps as usize {
            self.reach(&mut joints, &between(&tip, &target, step as f64 / steps), &mut posture);
        }
        joints
    }

    /// Moves joints to those near by whose tip is nearest to a pose.
    fn reach(&self, joints: &mut [f64], target: &Pose, posture: &mut Posture) {
        let n = self.chain.len();
        let mut columns = vec![[0.0; 6]; n];
        for _ in 0..ITERATIONS {
            self.chain.posture(joints, posture);
            posture.jacobian(&mut columns);
            let tip = posture.tip();
            let turn: Vector3<f64> = so3::log(&(target.rotation * tip.rotation.transpose()));
            let shift = target.translation - tip.translation;
            let error = DVector::from_iterator(6, turn.iter().chain(&shift).copied());
            let jacobian = DMatrix::from_fn(6, n, |row, column| columns[column][row]);
            // Damping by the error slows the arm down at singularities and vanishes at the goal.
            let damping = DMatrix::identity(n, n) * (1e-2 * error.norm_squared() + 1e-12);
            let Some(factor) = (jacobian.transpose() * &jacobian + damping).cholesky() else { break };
            let step = factor.solve(&(jacobian.transpose() * error));
            let before = joints.to_vec();
            joints.iter_mut().zip(step.iter()).for_each(|(joint, step)| *joint += step);
            self.stop_at_ends(joints);
            if joints.iter().zip(&before).all(|(after, before)| (after - before).abs() < ARRIVED) {
                break;
            }
        }
    }

    fn stop_at_ends(&self, joints: &mut [f64]) {
        for (joint, limits) in joints.iter_mut().zip(&self.limits) {
            *joint = joint.min(limits.upper.unwrap_or(f64::INFINITY)).max(limits.lower.unwrap_or(f64::NEG_INFINITY));
        }
    }
}

impl Execution {
    pub(super) fn check(&self, rig: &Rig) -> Result<(), Error> {
        let n = rig.robot.joints.len();
        if !self.gain.is_empty() && self.gain.len() != n {
            let found = self.gain.len();
            return Err(Error::Unusable(format!("{found} gains are given, the robot has {n} joints")));
        }
        if let Some(coupling) = self.couplings.iter().find(|c| c.joint >= n || c.by >= n || !c.share.is_finite()) {
            return Err(Error::Unusable(format!("{coupling:?} is not of joints of {n}, or its share is not finite")));
        }
        let numbers = [self.joints, self.pose.xyz, self.pose.rot, self.share, self.dead_band];
        if numbers.iter().any(|sd| !(0.0..f64::INFINITY).contains(sd)) || self.gain.iter().any(|gain| !gain.is_finite())
        {
            return Err(Error::Unusable(
                "noise, gains and the dead band of a robot must be finite, and noise and dead band 0 or more"
                    .to_owned(),
            ));
        }
        Ok(())
    }
}
