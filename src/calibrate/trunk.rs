//! The nodes of a calibration's graph that belong to one sample: its joints or its tip, and what was measured of them.
use super::graph::{Built, Freedom, State, Tips, hold};
use super::setup::Setup;
use crate::factors::{ForwardKinematics, JointAction, JointReading, PoseAction, PoseReading};
use crate::rig::{Parent, PoseNoise};
use handeye_solvers::{DynamicVector, Key, Loss, Pose};
use std::sync::Arc;

/// Least standard deviation of a part of a pose that is exact beside one that is not [rad and m].
const EXACT: f64 = 1e-6;

/// Makes the nodes of each sample when they are first asked for.
pub(super) struct Trunk<'a> {
    setup: &'a Setup,
    state: &'a State,
    freedom: &'a Freedom,
    world: Key<Pose>,
    chain: Arc<crate::chain::Chain>,
    /// Links of the sample in hand.
    sample: usize,
    links: Vec<Option<Key<Pose>>>,
}

impl<'a> Trunk<'a> {
    pub fn new(setup: &'a Setup, state: &'a State, freedom: &'a Freedom, built: &mut Built) -> Self {
        let world = built.graph.held(Pose::identity());
        let chain = Arc::new(state.model.chain.clone());
        Trunk { setup, state, freedom, world, chain, sample: usize::MAX, links: Vec::new() }
    }

    /// The pose of what something is fixed to. Samples are gone through one after the other.
    pub fn carrier(&mut self, parent: Parent, sample: usize, built: &mut Built) -> Key<Pose> {
        match (parent, self.freedom.source) {
            (Parent::World, _) => self.world,
            (Parent::Tip, Tips::Seen | Tips::Read) => self.tip(sample, built),
            (Parent::Tip, Tips::Chain) => self.link(self.chain.len(), sample, built),
            (Parent::Link(joint), _) => self.link(joint + 1, sample, built),
        }
    }

    fn link(&mut self, upto: usize, sample: usize, built: &mut Built) -> Key<Pose> {
        if self.sample != sample {
            self.sample = sample;
            self.links = vec![None; self.chain.len() + 1];
        }
        if let Some(tip) = built.tips[sample].filter(|_| upto == self.chain.len()) {
            return tip;
        }
        let joints = self.joints(sample, built);
        let (base, parameters) = (built.base, built.parameters);
        let link = *self.links[upto].get_or_insert_with(|| {
            built.graph.derive(ForwardKinematics { chain: self.chain.clone(), upto }, (base, parameters, joints))
        });
        if upto == self.chain.len() {
            built.tips[sample] = Some(link);
        }
        link
    }

    fn joints(&self, sample: usize, built: &mut Built) -> Key<DynamicVector> {
        *built.joints[sample].get_or_insert_with(|| {
            let joints = DynamicVector::from_column_slice(&self.state.joints[sample]);
            if self.freedom.states[sample] { built.graph.held(joints) } else { built.graph.free(joints) }
        })
    }

    fn tip(&self, sample: usize, built: &mut Built) -> Key<Pose> {
        *built.tips[sample].get_or_insert_with(|| {
            let tip = built.graph.free(self.state.tips[sample]);
            hold(&mut built.graph, tip, &self.held_of_tip(sample));
            tip
        })
    }

    /// Where only the rotation or only the translation is noisy, the other is held.
    fn held_of_tip(&self, sample: usize) -> [bool; 6] {
        let noise = self.setup.rig.noise.pose;
        let read = self.freedom.source == Tips::Read && self.setup.states.poses[sample].is_some();
        let held = self.freedom.states[sample];
        let (rot, xyz) = (held || read && noise.rot == 0.0, held || read && noise.xyz == 0.0);
        [rot, rot, rot, xyz, xyz, xyz]
    }

    /// Factors on the states: readings and actions.
    pub fn measure(&mut self, loss: Loss, built: &mut Built) {
        let (states, noise) = (&self.setup.states, &self.setup.rig.noise);
        let held = |sample: usize| self.freedom.states[sample] || !self.state.placed[sample];
        for sample in (0..states.len()).filter(|&sample| !held(sample)) {
            if let Some(readings) = states.readings[sample].as_ref().filter(|_| self.state.trusted[sample]) {
                let on = (self.joints(sample, built),);
                for (joint, &reading) in readings.iter().enumerate() {
                    let factor = JointReading { joint, reading };
                    built.graph.factor(factor, on).sigma(noise.joints).loss(loss);
                }
            }
        }
        for sample in (0..states.len()).filter(|&sample| self.state.placed[sample]) {
            let used = noise.pose.is_noisy() && self.state.trusted[sample];
            let Some(reading) = states.poses[sample].filter(|_| used) else { continue };
            if !states.chain && held(sample) {
                continue;
            }
            let tip = self.carrier(Parent::Tip, sample, built);
            built.graph.factor(PoseReading { reading }, (tip, built.tool)).sigmas(sigmas(noise.pose)).loss(loss);
        }
        for sample in (0..states.len().saturating_sub(1)).filter(|&sample| !held(sample) || !held(sample + 1)) {
            if !(self.state.placed[sample] && self.state.placed[sample + 1]) {
                continue;
            }
            if let Some(actions) = states.joint_actions[sample].as_ref().filter(|_| noise.joint_action > 0.0) {
                let on = (self.joints(sample, built), self.joints(sample + 1, built));
                for (joint, &action) in actions.iter().enumerate() {
                    let factor = JointAction { joint, action };
                    built.graph.factor(factor, on).sigma(noise.joint_action).loss(loss);
                }
            }
            if let Some(action) = states.pose_actions[sample].filter(|_| noise.pose_action.is_noisy()) {
                let on = (self.carrier(Parent::Tip, sample, built), self.carrier(Parent::Tip, sample + 1, built));
                let sigmas = sigmas(noise.pose_action);
                built.graph.factor(PoseAction { action }, on).sigmas(sigmas).loss(loss);
            }
        }
    }
}

/// Rotation, then translation.
fn sigmas(noise: PoseNoise) -> [f64; 6] {
    let (rot, xyz) = (noise.rot.max(EXACT), noise.xyz.max(EXACT));
    [rot, rot, rot, xyz, xyz, xyz]
}
