//! Things that a robot grasps, or puts others into.
use crate::geometry::between;
use handeye_solvers::Pose;

/// A rigid thing that carries features. The rig has them on the tip, where they are when the thing is held (or inserted into) as it
/// should be; in the world it stands elsewhere until it is grasped.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Indices of its features in the rig.
    pub features: Vec<usize>,
    /// `world_from_tip` of the tip that would hold it as it should be held; of `tip_from_tip` once it is grasped.
    place: Pose,
    is_held: bool,
}

impl Object {
    /// An object that stands where a tip at this pose of the world would hold it as it should be held.
    pub fn new(features: Vec<usize>, world_from_tip: Pose) -> Self {
        Object { features, place: world_from_tip, is_held: false }
    }

    /// An object in the hand, held otherwise than it should be by this motion of the tip's frame.
    pub fn held(features: Vec<usize>, grip: Pose) -> Self {
        Object { features, place: grip, is_held: true }
    }

    /// Moves it with the tip from now on.
    pub(super) fn grasp(&mut self, tip: &Pose) {
        if !self.is_held {
            (self.place, self.is_held) = (tip.inverse() * self.place, true);
        }
    }

    /// Puts it elsewhere, unless it is held.
    pub(super) fn carry(&mut self, world_from_tip: Pose) {
        if !self.is_held {
            self.place = world_from_tip;
        }
    }

    /// The same at a share of the way to where it is at a later moment: evenly moved, or held by whoever holds it then.
    pub(super) fn between(&self, later: &Object, share: f64) -> Object {
        // Who grasps does so at the beginning of a motion.
        if self.is_held != later.is_held {
            return later.clone();
        }
        Object { place: between(&self.place, &later.place, share), ..later.clone() }
    }

    /// True where it moves with the tip.
    pub fn is_held(&self) -> bool {
        self.is_held
    }

    /// Pose in the world of the frame in which the rig gives its features.
    pub fn carrier(&self, tip: &Pose) -> Pose {
        if self.is_held { *tip * self.place } else { self.place }
    }

    /// From the tip's frame to that of a tip that would hold it as it should be held: the identity where the tip is right.
    pub fn misplacement(&self, tip: &Pose) -> Pose {
        tip.inverse() * self.carrier(tip)
    }
}
