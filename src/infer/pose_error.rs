//! How far the tip is from a pose, and the step of the joints that brings it nearer.
use super::box_step::BoxStep;
use super::joint_box::JointBox;
use crate::chain::{JointChain, Posture};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

/// Cost, gradient and Gauss-Newton matrix of
///
///   ½ |log(R_target Rᵀ)|² + ½ |t_target - t|² / L²
///
/// with the distance L that weighs as much as a radian. Its gradient is exact with the geometric Jacobian, at any angle. Kept between
/// calls, so that none but the first allocates.
#[derive(Clone, Debug, Default)]
pub(super) struct PoseError {
    /// Rotation vector [rad] and translation [m] that are left, in the world.
    turn: Vector3<f64>,
    shift: Vector3<f64>,
    /// 1 / L.
    weight: f64,
    posture: Posture,
    columns: Vec<[f64; 6]>,
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    program: BoxStep,
}

/// Step of the differences of the gradient [rad or m].
const STEP: f64 = 1e-5;

impl PoseError {
    /// The cost with these joints [rad²].
    #[inline]
    pub fn look(&mut self, chain: &JointChain, target: &Pose, joints: &[f64], length: f64) -> f64 {
        chain.posture(joints, &mut self.posture);
        let tip = self.posture.tip();
        self.turn = so3::log(&so3::times(&target.rotation, &tip.rotation.transpose()));
        self.shift = target.translation - tip.translation;
        self.weight = 1.0 / length;
        0.5 * (self.turn.norm_squared() + self.shift.norm_squared() * self.weight * self.weight)
    }

    /// Distance that is left [m].
    pub fn xyz(&self) -> f64 {
        self.shift.norm()
    }

    /// Angle that is left [rad].
    pub fn rot(&self) -> f64 {
        self.turn.norm()
    }

    #[inline]
    pub fn is_within(&self, xyz: f64, rot: f64) -> bool {
        self.turn.norm_squared() < rot * rot && self.shift.norm_squared() < xyz * xyz
    }

    /// The damped step from where [`PoseError::look`] was, inside the limits; `None` where it is not finite.
    ///
    /// `pull`: joints to be near to, and the weight of their squared distance.
    #[inline]
    pub fn step(
        &mut self,
        limits: &JointBox,
        joints: &[f64],
        damping: f64,
        pull: Option<(&[f64], f64)>,
    ) -> Option<&[f64]> {
        self.linearize(joints.len());
        let mut diagonal = damping;
        if let Some((near, weight)) = pull {
            // The pull's own curvature is as good as damping: the step is where both together are least.
            diagonal += weight;
            for (i, slope) in self.gradient.iter_mut().enumerate() {
                *slope += weight * (near[i] - joints[i]);
            }
        }
        self.solve(limits, joints, diagonal)
    }

    /// The damped Newton step from joints, inside the limits, with the whole Hessian by differences of the gradient: far from a pose
    /// that is out of reach, Gauss-Newton steps are far too long. `None` where the damping does not make it positive definite.
    pub fn newton_step(
        &mut self,
        chain: &JointChain,
        target: &Pose,
        limits: &JointBox,
        joints: &[f64],
        (length, damping): (f64, f64),
    ) -> Option<&[f64]> {
        let n = joints.len();
        let mut moved = joints.to_vec();
        let mut rows = Vec::with_capacity(n * n);
        for i in 0..n {
            for step in [STEP, -STEP] {
                moved[i] = joints[i] + step;
                self.look(chain, target, &moved, length);
                self.linearize(n);
                if step > 0.0 {
                    rows.extend_from_slice(&self.gradient);
                } else {
                    let row = rows[i * n..].iter_mut().zip(&self.gradient);
                    row.for_each(|(high, low)| *high = (low - *high) / (2.0 * STEP));
                }
            }
            moved[i] = joints[i];
        }
        self.look(chain, target, joints, length);
        self.linearize(n);
        for i in 0..n {
            for j in 0..=i {
                self.hessian[i * n + j] = 0.5 * (rows[i * n + j] + rows[j * n + i]);
            }
        }
        self.solve(limits, joints, damping)
    }

    /// Gradient, downhill, and Gauss-Newton matrix.
    #[inline]
    fn linearize(&mut self, n: usize) {
        self.columns.resize(n, [0.0; 6]);
        self.hessian.resize(n * n, 0.0);
        self.gradient.resize(n, 0.0);
        self.posture.jacobian(&mut self.columns);
        for column in &mut self.columns {
            column[3..].iter_mut().for_each(|x| *x *= self.weight);
        }
        let shift = self.shift * self.weight;
        let error = [self.turn.x, self.turn.y, self.turn.z, shift.x, shift.y, shift.z];
        for (i, column) in self.columns.iter().enumerate() {
            self.gradient[i] = dot(column, &error);
            for (j, other) in self.columns[..=i].iter().enumerate() {
                self.hessian[i * n + j] = dot(column, other);
            }
        }
    }

    #[inline]
    fn solve(&mut self, limits: &JointBox, joints: &[f64], damping: f64) -> Option<&[f64]> {
        limits.rooms(joints, &mut self.lower, &mut self.upper);
        let solved = self.program.solve(&self.hessian, &self.gradient, damping, &self.lower, &self.upper);
        solved.then_some(&self.program.step)
    }
}

#[inline]
fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
}
