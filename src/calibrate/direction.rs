//! A direction in which the numbers of a rig can move together, and what moving along it does.
use super::deviations::Honest;
use super::graph::{Built, State};
use crate::rig::Model;
use handeye_solvers::{Component, Pose, Variable, WeakDirection, Weakness};

/// Steps that derivatives along a direction are taken with, as a share of it.
const STEP: f64 = 1e-5;

/// Numbers that move together.
pub(crate) struct Direction {
    /// Coordinates and how far each moves, the largest 1.
    pub parts: Vec<Component>,
    /// Standard deviation along it, of the coordinate that moves by 1; `None` where nothing bounds it.
    pub sd: Option<f64>,
}

impl Direction {
    /// With the priors' information p along it, the data's is p/ratio².
    pub fn of_weak(honest: &Honest<'_>, built: &Built, weak: &WeakDirection) -> Self {
        let sigma = |part: &Component| prior_of(honest, built, part);
        let information = weak.components.iter().map(|part| (part.weight / sigma(part)).powi(2)).sum::<f64>();
        let information = information * (1.0 + weak.sd_ratio.powi(-2));
        let is_bounded = weak.kind == Weakness::Prior && information > 0.0;
        Direction { parts: weak.components.clone(), sd: is_bounded.then(|| information.sqrt().recip()) }
    }

    /// How far the tip of each sample moves in one standard deviation, at the joints where it is; `None` where nothing bounds
    /// it, or where tips are read.
    pub fn tip_motion(&self, honest: &Honest<'_>, state: &State, built: &Built, samples: &[usize]) -> Option<Vec<f64>> {
        let sd = self.sd.filter(|_| honest.setup.states.chain)?;
        let [ahead, behind] = self.both_ways(state, built);
        let tip = |model: &Model, sample: usize| model.tip(&state.joints[sample]).translation;
        Some(samples.iter().map(|&s| (tip(&ahead, s) - tip(&behind, s)).norm() * per_step(sd)).collect())
    }

    /// How far the centre of each camera moves against what it is mounted on in one standard deviation; `None` where nothing bounds it.
    pub fn camera_motion(&self, state: &State, built: &Built) -> Option<Vec<f64>> {
        let sd = self.sd?;
        let [ahead, behind] = self.both_ways(state, built).map(|model| model.cameras);
        let centres = ahead.iter().zip(&behind).map(|(a, b)| (a.pose.translation - b.pose.translation).norm());
        Some(centres.map(|step| step * per_step(sd)).collect())
    }

    /// The model a step ahead, and a step behind.
    pub fn both_ways(&self, state: &State, built: &Built) -> [Model; 2] {
        [STEP, -STEP].map(|by| self.moved(state, built, by))
    }

    fn moved(&self, state: &State, built: &Built, by: f64) -> Model {
        let mut model = state.model.clone();
        let of = |node: usize| -> Vec<(usize, f64)> {
            let parts = self.parts.iter().filter(|part| part.node == node);
            parts.map(|part| (part.coordinate, by * part.weight)).collect()
        };
        for (coordinate, step) in of(built.parameters.index()) {
            model.parameters[coordinate] += step;
        }
        model.base = stepped(&model.base, &of(built.base.index()));
        for (camera, (pose, lens)) in model.cameras.iter_mut().zip(&built.cameras) {
            camera.pose = stepped(&camera.pose, &of(pose.index()));
            of(lens.index()).into_iter().for_each(|(coordinate, step)| camera.intrinsics[coordinate] += step);
        }
        for (feature, key) in model.features.iter_mut().zip(&built.features) {
            of(key.index()).into_iter().for_each(|(coordinate, step)| feature.xyz[coordinate] += step);
        }
        model
    }
}

/// What turns the difference of [`Direction::both_ways`] into that of one standard deviation.
pub(crate) fn per_step(sd: f64) -> f64 {
    sd / (2.0 * STEP)
}

/// Standard deviation of a coordinate's prior; infinite without one.
fn prior_of(honest: &Honest<'_>, built: &Built, part: &Component) -> f64 {
    let (priors, node, k) = (honest.priors, part.node, part.coordinate);
    if node == built.base.index() {
        return priors.base[k];
    }
    if node == built.parameters.index() {
        return priors.parameters[k];
    }
    for (camera, (pose, lens)) in built.cameras.iter().enumerate() {
        if node == pose.index() {
            return priors.cameras[camera][k];
        }
        if node == lens.index() {
            return priors.intrinsics[camera][k];
        }
    }
    let feature = built.features.iter().position(|key| key.index() == node);
    feature.map_or(f64::INFINITY, |feature| priors.features[feature][k])
}

/// A pose moved by some coordinates of a step.
pub(crate) fn stepped(pose: &Pose, parts: &[(usize, f64)]) -> Pose {
    let mut stored = vec![0.0; pose.ambient()];
    Pose::store(pose, &mut stored);
    Pose::retract::<f64>(&stored, |k| parts.iter().filter(|(at, _)| *at == k).map(|(_, step)| step).sum())
}
