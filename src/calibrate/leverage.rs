//! How much of what is estimated each group of measurements decides: its leverage, in coordinates. All add up to the number of free
//! ones.
use super::graph::{Built, Freedom, Priors, State, Tips};
use super::observation::{Kind, Observation};
use super::setup::Setup;
use super::stage::Stage;
use super::trunk::Trunk;
use crate::factors::InCamera;
use handeye_solvers::{Covariance, Key, Vector};

/// Points whose leverage is computed, spread evenly over the recording; the others are taken to have as much in the mean.
const POINTS: usize = 400;

/// Nodes of points as they are predicted.
pub(super) struct PredictedPoints {
    /// Index of the observation, and its node.
    nodes: Vec<(usize, Key<Vector<3>>)>,
    /// How many observations each stands for.
    each: f64,
}

impl PredictedPoints {
    /// Adds nodes to a graph for points that take part in it.
    pub fn new(setup: &Setup, state: &State, freedom: &Freedom, built: &mut Built) -> Self {
        let is_point = |index: &usize| setup.observations[*index].kind() == Kind::Points;
        let all: Vec<usize> = built.factors.iter().map(|(index, _)| *index).filter(is_point).collect();
        let every = all.len().div_ceil(POINTS).max(1);
        let mut trunk = Trunk::new(setup, state, freedom, built);
        let mut nodes = Vec::new();
        for &index in all.iter().step_by(every) {
            let &Observation { sample, camera, feature, .. } = &setup.observations[index];
            let carrier = trunk.carrier(state.model.features[feature].parent, sample, built);
            let mount = trunk.carrier(state.model.cameras[camera].parent, sample, built);
            let on = (carrier, built.features[feature], mount, built.cameras[camera].0);
            nodes.push((index, built.graph.derive(InCamera, on)));
        }
        let each = all.len() as f64 / nodes.len().max(1) as f64;
        PredictedPoints { nodes, each }
    }

    /// Σ w tr(Σ) / σ² with Σ the covariance of a predicted point and w the weight that the loss gives it.
    pub fn leverage(&self, setup: &Setup, last: &Stage<'_>, whitened: &[f64], covariance: &mut Covariance<'_>) -> f64 {
        let variance = setup.sd(Kind::Points).powi(2);
        let of_one = |&(index, node): &(usize, Key<Vector<3>>)| {
            let (_, weight) = last.loss.evaluate(whitened[index].powi(2), 1.0);
            weight * covariance.of(node).trace() / variance
        };
        self.each * self.nodes.iter().map(of_one).sum::<f64>()
    }
}

/// Free coordinates of the rig and of all states in the graph.
pub(super) fn count_free(freedom: &Freedom, built: &Built) -> usize {
    let free = |held: &[bool]| held.iter().filter(|held| !**held).count();
    let rig = free(&freedom.base)
        + free(&freedom.parameters)
        + freedom.cameras.iter().map(|held| free(held)).sum::<usize>()
        + freedom.intrinsics.iter().map(|held| free(held)).sum::<usize>()
        + freedom.features.iter().map(|held| free(held)).sum::<usize>();
    let of_joints = built.joints.iter().zip(&freedom.states).filter(|(key, held)| key.is_some() && !**held).count();
    let of_tips = match freedom.source {
        Tips::Chain => 0,
        _ => built.tips.iter().zip(&freedom.states).filter(|(key, held)| key.is_some() && !**held).count(),
    };
    rig + of_joints * (freedom.parameters.len() / crate::chain::LINK_PARAMETERS) + 6 * of_tips
}

/// What the priors of the rig's numbers decide, in coordinates.
pub(super) fn leverage_of_priors(
    priors: &Priors,
    freedom: &Freedom,
    built: &Built,
    covariance: &mut Covariance<'_>,
) -> f64 {
    let mut sum = 0.0;
    let mut add = |block: nalgebra::DMatrix<f64>, sigmas: &[f64], held: &[bool]| {
        for (i, (sigma, held)) in sigmas.iter().zip(held).enumerate() {
            if sigma.is_finite() && !held {
                sum += block[(i, i)] / (sigma * sigma);
            }
        }
    };
    if freedom.source == Tips::Chain {
        add(covariance.of(built.base), &priors.base, &freedom.base);
        add(covariance.of(built.parameters), &priors.parameters, &freedom.parameters);
    }
    for (index, &(pose, intrinsics)) in built.cameras.iter().enumerate() {
        add(covariance.of(pose), &priors.cameras[index], &freedom.cameras[index]);
        add(covariance.of(intrinsics), &priors.intrinsics[index], &freedom.intrinsics[index]);
    }
    for (index, &feature) in built.features.iter().enumerate() {
        add(covariance.of(feature), &priors.features[index], &freedom.features[index]);
    }
    sum
}
