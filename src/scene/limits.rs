//! The limits of scenes.
use super::{LimitKind, Scene};
use crate::rig::Rig;
use crate::servo::Limit;
use crate::servo::limits::{HalfSpace, InImage, PixelSpeed, TipBox, TipSpeed, VirtualFixture};
use handeye_solvers::Pose;

/// Strength of a scene's limits against each other.
const STRENGTH: f64 = 10.0;

impl Scene {
    /// The limits for a rig, one by one, with their names.
    pub(super) fn limits(&self, known: &Rig) -> Vec<(String, Box<dyn Limit>)> {
        let features: Vec<usize> = (0..known.features.len()).collect();
        let mut limits: Vec<(String, Box<dyn Limit>)> = Vec::new();
        for (name, kind) in &self.limits {
            let cameras = 0..known.cameras.len();
            let mut add = |limit: Box<dyn Limit>| limits.push((name.clone(), limit));
            match *kind {
                LimitKind::InImage(margin) => cameras.for_each(|camera| {
                    add(Box::new(InImage { camera, features: features.clone(), margin, strength: STRENGTH }));
                }),
                LimitKind::PixelSpeed(speed) => cameras.for_each(|camera| {
                    add(Box::new(PixelSpeed { camera, features: features.clone(), speed, strength: STRENGTH }));
                }),
                LimitKind::TipSpeed(speed) => add(Box::new(TipSpeed { speed, strength: STRENGTH })),
                LimitKind::HalfSpace(normal, offset) => add(Box::new(HalfSpace { normal, offset, strength: STRENGTH })),
                LimitKind::TipBox(low, high) => {
                    add(Box::new(TipBox { frame: Pose::identity(), low, high, strength: STRENGTH }));
                }
                LimitKind::Follow(guide, tolerance) => {
                    add(Box::new(VirtualFixture { guide, tolerance, strength: STRENGTH }));
                }
            }
        }
        limits
    }
}
