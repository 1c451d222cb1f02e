//! Links with frames of their own, which stand fixed against those that the rows make: how a URDF's links lie on
//! Denavit-Hartenberg rows.
use super::Chain;
use handeye_solvers::{Pose, Scalar};

/// Constant poses between the frames that rows make and those of the links.
///
///   world_from_link_i = B · S · ∏_{k ≤ i} row_k · F_i
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// S, `base_from_start`: where the first row begins.
    pub start: Pose,
    /// F of every joint, `row_from_link`: the link in the frame that its row makes.
    pub links: Vec<Pose>,
}

impl Chain {
    /// Where the first row begins, in the world.
    #[inline]
    pub(crate) fn start<T: Scalar>(&self, world_from_base: &Pose<T>) -> Pose<T> {
        self.frames.as_ref().map_or(*world_from_base, |frames| *world_from_base * frames.start.lift())
    }

    /// The pose of link `i`, from that of the frame which its row makes.
    #[inline]
    pub(crate) fn own_frame<T: Scalar>(&self, i: usize, world_from_row: Pose<T>) -> Pose<T> {
        self.frames.as_ref().map_or(world_from_row, |frames| world_from_row * frames.links[i].lift())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::Vector3;

    pub(in crate::chain) fn frames(n_joints: usize) -> Frames {
        let pose = |i: usize| {
            let s = |k: usize| (1.3 * (7 * i + k) as f64).sin();
            Pose::new(Vector3::new(s(0), s(1), s(2)), Vector3::new(s(3), s(4), s(5)))
        };
        Frames { start: pose(0), links: (1..=n_joints).map(pose).collect() }
    }
}
