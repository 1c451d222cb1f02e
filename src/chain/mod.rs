//! Chains: joint readings to the pose of every link; one file per joint convention.
use handeye_solvers::{Pose, Scalar};

mod dh;
mod frames;
mod jacobian;
mod joint_chain;
mod modified_dh;

pub use frames::Frames;
pub use jacobian::ChainJacobian;
pub use joint_chain::{Axis, JointChain, Posture};

/// Numbers of a link: offset [rad], d [m], a [m], alpha [rad], beta [rad].
pub const LINK_PARAMETERS: usize = 5;

/// Sine of the angle between two axes below which they count as parallel [about 11.5°]: their common normal is ill-defined,
/// and Hayati's beta describes the second in place of d.
pub(crate) const PARALLEL: f64 = 0.2;

/// How a row of parameters makes a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Convention {
    /// Standard Denavit-Hartenberg.
    #[default]
    Dh,
    /// Modified Denavit-Hartenberg (Craig).
    ModifiedDh,
}

impl Convention {
    /// Every convention.
    pub const ALL: &'static [Convention] = &[Convention::Dh, Convention::ModifiedDh];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Convention::Dh => "dh",
            Convention::ModifiedDh => "modified-dh",
        }
    }

    /// The convention of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|convention| convention.name() == name)
    }

    /// Pose of a link in the one before, `parent_from_link`.
    ///
    /// `parameters`: offset, d, a, alpha, beta. `reading`: of the joint [rad or m], counted along its axis; added to
    /// the offset where the joint is revolute, to d where it is prismatic. The formulas stand in the conventions'
    /// files.
    #[inline]
    pub fn link<T: Scalar>(self, kind: JointKind, parameters: &[T; LINK_PARAMETERS], reading: T) -> Pose<T> {
        let &[offset, d, a, alpha, beta] = parameters;
        let (angle, d) = match kind {
            JointKind::Revolute => (offset + reading, d),
            JointKind::Prismatic => (offset, d + reading),
        };
        match self {
            Convention::Dh => dh::link(angle, d, a, alpha, beta),
            Convention::ModifiedDh => modified_dh::link(angle, d, a, alpha, beta),
        }
    }
}

/// What a joint does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis.
    #[default]
    Revolute,
    /// Slides along its axis.
    Prismatic,
}

impl JointKind {
    /// Every kind of joint.
    pub const ALL: &'static [JointKind] = &[JointKind::Revolute, JointKind::Prismatic];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        }
    }
}

/// What of a chain of joints is not estimated. Parameters are passed along: five per joint, as in [`LINK_PARAMETERS`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chain {
    /// How a row of parameters makes a link.
    pub convention: Convention,
    /// What each joint does, from base to tip.
    pub kinds: Vec<JointKind>,
    /// True where a joint's reading counts against its axis; as long as `kinds`.
    pub reversed: Vec<bool>,
    /// Where the links have frames of their own; `None` where the frames that the rows make are the links'.
    pub frames: Option<Frames>,
}

impl Chain {
    /// Number of joints.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// True where there is no joint: the tip is the base.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Pose of every link in the world, `world_from_link`, from base to tip; the base itself is not among them.
    ///
    /// `parameters`: five per joint. `joints`: one reading per joint [rad or m].
    pub fn links(&self, world_from_base: &Pose, parameters: &[f64], joints: &[f64]) -> Vec<Pose> {
        let mut world_from_row = self.start(world_from_base);
        let next = |i| {
            world_from_row = world_from_row * self.row(i, parameters, joints);
            self.own_frame(i, world_from_row)
        };
        (0..self.len()).map(next).collect()
    }

    /// Pose of the last link in the world, `world_from_tip`: the last of [`Chain::links`], without allocating.
    pub fn tip(&self, world_from_base: &Pose, parameters: &[f64], joints: &[f64]) -> Pose {
        self.upto(self.len(), world_from_base, parameters, joints)
    }

    /// Pose in the world of the link after `upto` joints: 0 for the base.
    pub(crate) fn upto(&self, upto: usize, world_from_base: &Pose, parameters: &[f64], joints: &[f64]) -> Pose {
        let Some(last) = upto.checked_sub(1) else { return *world_from_base };
        let rows = (0..upto).fold(self.start(world_from_base), |pose, i| pose * self.row(i, parameters, joints));
        self.own_frame(last, rows)
    }

    /// Pose of the frame that row `i` makes in the one before.
    #[inline]
    fn row(&self, i: usize, parameters: &[f64], joints: &[f64]) -> Pose {
        let at = LINK_PARAMETERS * i;
        let row = std::array::from_fn(|k| parameters[at + k]);
        self.convention.link(self.kinds[i], &row, self.sign(i) * joints[i])
    }

    #[inline]
    fn sign(&self, i: usize) -> f64 {
        if self.reversed[i] { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn names_are_found_again() {
        for &convention in Convention::ALL {
            assert_eq!(Convention::from_name(convention.name()), Some(convention));
        }
        assert_eq!(Convention::from_name("hayati"), None);
    }

    // The UR5 of FORMATS, stretched out along x: d and a as published by Universal Robots.
    #[test]
    fn an_outstretched_arm_reaches_as_far_as_its_data_sheet_says() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let d = [0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823];
        let a = [0.0, -0.425, -0.39225, 0.0, 0.0, 0.0];
        let alpha = [quarter, 0.0, 0.0, quarter, -quarter, 0.0];
        let parameters: Vec<f64> = (0..6).flat_map(|i| [0.0, d[i], a[i], alpha[i], 0.0]).collect();
        let chain = Chain {
            convention: Convention::Dh,
            kinds: vec![JointKind::Revolute; 6],
            reversed: vec![false; 6],
            frames: None,
        };
        let tip = chain.tip(&Pose::identity(), &parameters, &[0.0; 6]);
        let expected = Vector3::new(-0.425 - 0.39225, -0.10915 - 0.0823, 0.089159 - 0.09465);
        assert!((tip.translation - expected).norm() < 1e-12);
        assert_eq!(chain.links(&Pose::identity(), &parameters, &[0.0; 6]).last(), Some(&tip));
    }

    #[test]
    fn a_reversed_joint_counts_the_other_way() {
        let parameters = [0.3, 0.1, 0.2, -0.4, 0.05];
        for &convention in Convention::ALL {
            for kind in [JointKind::Revolute, JointKind::Prismatic] {
                let chain = |reversed| Chain { convention, kinds: vec![kind], reversed: vec![reversed], frames: None };
                let base = Pose::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 2.0, 3.0));
                assert_eq!(chain(true).tip(&base, &parameters, &[0.7]), chain(false).tip(&base, &parameters, &[-0.7]));
            }
        }
    }
}
