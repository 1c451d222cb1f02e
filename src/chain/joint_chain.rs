//! A chain of which only the joints move: link poses and the geometric Jacobian, fast enough for control loops.
use super::{Chain, Convention, Frames, JointKind, LINK_PARAMETERS};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Vector3};

/// A chain with known parameters, prepared once.
///
///   world_from_link_i = B · ∏_{k ≤ i} Rz(ω_k) Tz(d_k) F_k      (standard)
///   world_from_link_i = B · ∏_{k ≤ i} F_k Rz(ω_k) Tz(d_k)      (modified)
///
/// F holds what no joint moves, a, alpha and beta, and is computed here; a joint's reading is part of ω or d. Frames that the
/// links have of their own follow the products.
#[derive(Clone, Debug, PartialEq)]
pub struct JointChain {
    base: Pose,
    /// Where the first row begins, in the world.
    start: Pose,
    convention: Convention,
    joints: Vec<Joint>,
    frames: Option<Frames>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Joint {
    kind: JointKind,
    /// -1 where the reading counts against the axis.
    sign: f64,
    offset: f64,
    d: f64,
    /// F.
    fixed: Pose,
}

/// Where every link and every axis is; kept between calls, so that none but the first allocates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posture {
    /// `world_from_link`, the base first: as many as joints and one more, as `rig::Model::links` returns them.
    pub links: Vec<Pose>,
    /// Axis of every joint in the world.
    pub axes: Vec<Axis>,
}

/// The axis of a joint in the world, where its reading grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// What the joint does.
    pub kind: JointKind,
    /// Unit direction.
    pub direction: Vector3<f64>,
    /// A point on the axis [m].
    pub origin: Vector3<f64>,
}

impl Axis {
    /// (w, v): how a body beyond the joint turns [rad per unit of the joint], and how its point at `point` [m] moves [m per unit],
    /// both in the world.
    #[inline]
    pub fn twist(&self, point: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        match self.kind {
            JointKind::Revolute => (self.direction, self.direction.cross(&(point - self.origin))),
            JointKind::Prismatic => (Vector3::zeros(), self.direction),
        }
    }
}

impl JointChain {
    /// `parameters`: five per joint, as in [`LINK_PARAMETERS`].
    pub fn new(chain: &Chain, world_from_base: &Pose, parameters: &[f64]) -> Self {
        let joint = |(i, row): (usize, &[f64])| {
            let &[offset, d, a, alpha, beta] = row else { unreachable!("rows are of {LINK_PARAMETERS}") };
            let held = chain.convention.link(JointKind::Revolute, &[0.0, 0.0, a, alpha, beta], 0.0);
            Joint { kind: chain.kinds[i], sign: chain.sign(i), offset, d, fixed: held }
        };
        let joints = parameters.chunks_exact(LINK_PARAMETERS).take(chain.len()).enumerate().map(joint).collect();
        let (start, frames) = (chain.start(world_from_base), chain.frames.clone());
        JointChain { base: *world_from_base, start, convention: chain.convention, joints, frames }
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// True where there is no joint: the tip is the base.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// What each joint does, from base to tip.
    pub fn kinds(&self) -> impl ExactSizeIterator<Item = JointKind> {
        self.joints.iter().map(|joint| joint.kind)
    }

    /// `world_from_tip`. `joints`: one reading per joint [rad or m].
    pub fn tip(&self, joints: &[f64]) -> Pose {
        let mut pose = if self.is_empty() { self.base } else { self.start };
        for (joint, &reading) in self.joints.iter().zip(joints) {
            pose = match self.convention {
                Convention::Dh => times(&joint.moved(pose, reading), &joint.fixed),
                Convention::ModifiedDh => joint.moved(times(&pose, &joint.fixed), reading),
            };
        }
        match self.frames.as_ref().and_then(|frames| frames.links.last()) {
            Some(frame) => times(&pose, frame),
            None => pose,
        }
    }

    /// Poses of all links and axes of all joints. `joints`: one reading per joint [rad or m].
    pub fn posture(&self, joints: &[f64], posture: &mut Posture) {
        posture.links.resize(self.joints.len() + 1, self.base);
        posture.axes.resize(self.joints.len(), Axis::default());
        posture.links[0] = self.base;
        let mut pose = self.start;
        let places = posture.links[1..].iter_mut().zip(&mut posture.axes);
        for ((joint, &reading), (link, axis)) in self.joints.iter().zip(joints).zip(places) {
            let before = match self.convention {
                Convention::Dh => pose,
                Convention::ModifiedDh => times(&pose, &joint.fixed),
            };
            *axis = Axis {
                kind: joint.kind,
                direction: before.rotation.column(2) * joint.sign,
                origin: before.translation,
            };
            let moved = joint.moved(before, reading);
            pose = match self.convention {
                Convention::Dh => times(&moved, &joint.fixed),
                Convention::ModifiedDh => moved,
            };
            *link = pose;
        }
        if let Some(frames) = &self.frames {
            posture.links[1..].iter_mut().zip(&frames.links).for_each(|(link, frame)| *link = times(link, frame));
        }
    }
}

impl Posture {
    /// `world_from_tip`; the identity before the first [`JointChain::posture`].
    #[inline]
    pub fn tip(&self) -> Pose {
        self.links.last().copied().unwrap_or_else(Pose::identity)
    }

    /// Geometric Jacobian of the tip, one column per joint: w [rad per unit], then v [m per unit] of the tip's origin, both in the
    /// world.
    #[inline]
    pub fn jacobian(&self, columns: &mut [[f64; 6]]) {
        let tip = self.tip().translation;
        for (column, axis) in columns.iter_mut().zip(&self.axes) {
            let (w, v) = axis.twist(&tip);
            *column = [w.x, w.y, w.z, v.x, v.y, v.z];
        }
    }
}

impl Default for Axis {
    fn default() -> Self {
        Axis { kind: JointKind::Revolute, direction: Vector3::z(), origin: Vector3::zeros() }
    }
}

impl Joint {
    /// Rz(ω) Tz(d) after `before`.
    #[inline]
    fn moved(&self, before: Pose, reading: f64) -> Pose {
        let (angle, along) = match self.kind {
            JointKind::Revolute => (self.offset + self.sign * reading, self.d),
            JointKind::Prismatic => (self.offset, self.d + self.sign * reading),
        };
        let (s, c) = angle.sin_cos();
        let r = &before.rotation;
        let (x, y, z) = (r.column(0), r.column(1), r.column(2));
        Pose {
            rotation: Matrix3::from_columns(&[x * c + y * s, y * c - x * s, z.into_owned()]),
            translation: before.translation + z * along,
        }
    }
}

#[inline]
fn times(a: &Pose, b: &Pose) -> Pose {
    Pose {
        rotation: so3::times(&a.rotation, &b.rotation),
        translation: so3::apply(&a.rotation, &b.translation) + a.translation,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::ChainJacobian;
    use crate::chain::frames::tests::frames;

    #[test]
    fn poses_and_derivatives_are_those_of_the_whole_chain() {
        use JointKind::{Prismatic, Revolute};
        let base = Pose::new(Vector3::new(0.3, -0.8, 0.4), Vector3::new(0.5, -1.0, 0.2));
        let parameters: Vec<f64> = (0..25).map(|i| (f64::from(i) * 1.7).sin()).collect();
        let joints = [0.4, -0.9, 0.3, 1.4, -0.2];
        let chains = Convention::ALL.iter().flat_map(|&convention| [(convention, None), (convention, Some(frames(5)))]);
        for (convention, frames) in chains {
            let chain = Chain {
                convention,
                kinds: vec![Revolute, Prismatic, Revolute, Revolute, Prismatic],
                reversed: vec![false, false, true, false, true],
                frames,
            };
            let (prepared, mut posture) = (JointChain::new(&chain, &base, &parameters), Posture::default());
            prepared.posture(&joints, &mut posture);
            let close = |a: &Pose, b: &Pose| {
                (a.rotation - b.rotation).norm() < 1e-14 && (a.translation - b.translation).norm() < 1e-14
            };
            let links = chain.links(&base, &parameters, &joints);
            assert!(posture.links[0] == base && posture.links[1..].iter().zip(&links).all(|(a, b)| close(a, b)));
            assert!(close(&prepared.tip(&joints), &links[4]));
            let mut expected = ChainJacobian::default();
            chain.linearize(&base, &parameters, &joints, 5, &mut expected);
            let mut found = [[0.0; 6]; 5];
            posture.jacobian(&mut found);
            for (found, expected) in found.as_flattened().iter().zip(expected.joints.as_flattened()) {
                assert!((found - expected).abs() < 1e-13, "{found} {expected}");
            }
        }
    }
}
