//! Derivatives of a link's pose: dual numbers within each link, the chain rule of rigid motion between them.
//!
//! For link i with A = base · L₁ ⋯ Lᵢ₋₁ before it, a parameter that turns Lᵢ by w and moves it by v (both in the frame
//! of link i - 1: dR = [w] R, dt = v) turns the last link by R_A w in the world and moves its origin by
//! R_A v + (R_A w) × (t - tᵢ), with tᵢ the origin of row i's frame and t that of the last link, in the world. Links with
//! frames of their own differ from their rows' by a constant, which changes t alone.
use super::{Chain, JointKind, LINK_PARAMETERS};
use handeye_solvers::scalar::{Dual, derivatives, seed};
use handeye_solvers::{Pose, Scalar};
use nalgebra::Vector3;

/// A column of derivatives in `Pose`'s own step: rotation vector [rad per unit], then translation [m per unit], both in
/// the world.
type Column = [f64; 6];

/// (w, v), both in the frame of the link before.
type Motion = (Vector3<f64>, Vector3<f64>);

/// Derivatives of a link's pose. Kept between calls, so that none but the first allocates.
#[derive(Clone, Debug, Default)]
pub struct ChainJacobian {
    /// By the base's step: rotation vector, then translation, in the world.
    pub base: [Column; 6],
    /// By the links' parameters, five per joint; 0 beyond the link.
    pub parameters: Vec<Column>,
    /// By the joints' readings; 0 beyond the link.
    pub joints: Vec<Column>,
    /// Origin in the world of the frame that each row makes.
    origins: Vec<Vector3<f64>>,
}

impl Chain {
    /// Pose in the world of the link after `upto` joints, and its derivatives.
    ///
    /// `upto`: 0 for the base, `len()` for the tip, i + 1 for the link of joint i. `parameters`: five per joint.
    /// `joints`: one reading per joint [rad or m].
    pub fn linearize(
        &self,
        world_from_base: &Pose,
        parameters: &[f64],
        joints: &[f64],
        upto: usize,
        jacobian: &mut ChainJacobian,
    ) -> Pose {
        jacobian.clear(self.len());
        let Some(last) = upto.checked_sub(1) else {
            jacobian.of_base(world_from_base, world_from_base);
            return *world_from_base;
        };
        let mut pose = self.start(world_from_base);
        for (i, &joint) in joints.iter().enumerate().take(upto) {
            let at = LINK_PARAMETERS * i;
            let dual = std::array::from_fn(|k| seed::<LINK_PARAMETERS>(parameters[at + k], k));
            let reading = Dual::from_re(self.sign(i) * joint);
            let link = self.convention.link(self.kinds[i], &dual, reading);
            let (value, motions) = motions(&link);
            for (column, (w, v)) in jacobian.parameters[at..].iter_mut().zip(motions) {
                *column = stack(pose.rotation * w, pose.rotation * v);
            }
            pose = pose * value;
            jacobian.origins[i] = pose.translation;
        }
        let link = self.own_frame(last, pose);
        for i in 0..upto {
            let lever = link.translation - jacobian.origins[i];
            let at = LINK_PARAMETERS * i;
            for column in &mut jacobian.parameters[at..at + LINK_PARAMETERS] {
                let moved = Vector3::new(column[0], column[1], column[2]).cross(&lever);
                (0..3).for_each(|k| column[3 + k] += moved[k]);
            }
            // The reading is added to the offset or to d.
            let added_to = if self.kinds[i] == JointKind::Revolute { 0 } else { 1 };
            jacobian.joints[i] = jacobian.parameters[at + added_to].map(|v| self.sign(i) * v);
        }
        jacobian.of_base(world_from_base, &link);
        link
    }
}

impl ChainJacobian {
    fn clear(&mut self, n_joints: usize) {
        self.parameters.clear();
        self.parameters.resize(LINK_PARAMETERS * n_joints, [0.0; 6]);
        self.joints.clear();
        self.joints.resize(n_joints, [0.0; 6]);
        self.origins.resize(n_joints, Vector3::zeros());
    }

    fn of_base(&mut self, base: &Pose, link: &Pose) {
        for k in 0..3 {
            let axis = Vector3::ith(k, 1.0);
            self.base[k] = stack(axis, axis.cross(&(link.translation - base.translation)));
            self.base[3 + k] = stack(Vector3::zeros(), axis);
        }
    }
}

/// The value of a pose with derivatives, and for each of them the motion (w, v) with dR = [w] R and dt = v.
#[inline]
fn motions<const N: usize>(pose: &Pose<Dual<N>>) -> (Pose, [Motion; N]) {
    let value = Pose { rotation: pose.rotation.map(|x| x.value()), translation: pose.translation.map(|x| x.value()) };
    let r = &value.rotation;
    let (dr, dt) = (pose.rotation.map(|x| derivatives(&x)), pose.translation.map(|x| derivatives(&x)));
    // [w] = dR Rᵀ, of which three elements are needed.
    let element = |n: usize, i: usize, j: usize| -> f64 { (0..3).map(|k| dr[(i, k)][n] * r[(j, k)]).sum() };
    let motion = |n| {
        let w = Vector3::new(element(n, 2, 1), element(n, 0, 2), element(n, 1, 0));
        (w, Vector3::from_fn(|i, _| dt[i][n]))
    };
    (value, std::array::from_fn(motion))
}

#[inline]
fn stack(w: Vector3<f64>, v: Vector3<f64>) -> Column {
    [w.x, w.y, w.z, v.x, v.y, v.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::Convention;
    use crate::chain::frames::tests::frames;
    use handeye_solvers::Variable;

    /// Central difference of a pose, in its own step.
    fn difference(pose: impl Fn(f64) -> Pose) -> Column {
        let h = 1e-6;
        let mut at = [0.0; 12];
        pose(0.0).write_stored(&mut at);
        let [mut high, mut low] = [[0.0; 6]; 2];
        <Pose as Variable>::local(&at, &pose(h), &mut high);
        <Pose as Variable>::local(&at, &pose(-h), &mut low);
        std::array::from_fn(|k| (high[k] - low[k]) / (2.0 * h))
    }

    fn agrees(found: &Column, expected: &Column, what: &str) {
        for k in 0..6 {
            assert!((found[k] - expected[k]).abs() < 1e-8, "{what}: {found:?} {expected:?}");
        }
    }

    #[test]
    fn derivatives_of_every_link_agree_with_differences() {
        use JointKind::{Prismatic, Revolute};
        let base = Pose::new(Vector3::new(0.3, -0.8, 0.4), Vector3::new(0.5, -1.0, 0.2));
        let parameters: Vec<f64> = (0..25).map(|i| (f64::from(i) * 1.7).sin()).collect();
        let joints = [0.4, -0.9, 0.3, 1.4, -0.2];
        let mut jacobian = ChainJacobian::default();
        let chains = Convention::ALL.iter().flat_map(|&convention| [(convention, None), (convention, Some(frames(5)))]);
        for (convention, frames) in chains {
            let chain = Chain {
                convention,
                kinds: vec![Revolute, Prismatic, Revolute, Revolute, Prismatic],
                reversed: vec![false, false, true, false, true],
                frames,
            };
            for upto in 0..=chain.len() {
                let pose = |base: &Pose, parameters: &[f64], joints: &[f64]| match upto {
                    0 => *base,
                    _ => chain.links(base, parameters, joints)[upto - 1],
                };
                let found = chain.linearize(&base, &parameters, &joints, upto, &mut jacobian);
                assert_eq!(found, pose(&base, &parameters, &joints));
                for (k, column) in jacobian.base.iter().enumerate() {
                    let mut stored = [0.0; 12];
                    base.write_stored(&mut stored);
                    let moved = |s| Pose::retract(&stored, |i| if i == k { s } else { 0.0 });
                    agrees(column, &difference(|s| pose(&moved(s), &parameters, &joints)), "base");
                }
                for (k, column) in jacobian.parameters.iter().enumerate() {
                    let moved = |s| {
                        let mut parameters = parameters.clone();
                        parameters[k] += s;
                        pose(&base, &parameters, &joints)
                    };
                    agrees(column, &difference(moved), "parameters");
                }
                for (k, column) in jacobian.joints.iter().enumerate() {
                    let moved = |s| {
                        let mut joints = joints;
                        joints[k] += s;
                        pose(&base, &parameters, &joints)
                    };
                    agrees(column, &difference(moved), "joints");
                }
            }
        }
    }
}
