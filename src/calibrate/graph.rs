//! The graph of a calibration: which nodes are free is a table, the factors are the same for every stage.
use super::setup::Setup;
use crate::chain::LINK_PARAMETERS;
use crate::factors::{ForwardKinematics, Intrinsics, Reprojection};
use crate::rig::{Model, Parent};
use handeye_solvers::{DynamicVector, FactorKey, Graph, Key, Loss, Pose, Vector};
use std::sync::Arc;

/// Where everything is now.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Chain, cameras and features.
    pub model: Model,
    /// `world_from_tip` of every sample, for the stages in which tips are free.
    pub tips: Vec<Pose>,
}

/// What is free, and what is known of it. Where a list is indexed by coordinate, true means held.
#[derive(Clone, Debug)]
pub(crate) struct Freedom {
    /// Whether tips are derived from the chain (end to end) or free.
    pub chain: bool,
    /// Coordinates of the base's step, of the chain's parameters, of each camera's step and intrinsics, of each feature.
    pub base: [bool; 6],
    pub parameters: Vec<bool>,
    pub cameras: Vec<[bool; 6]>,
    pub intrinsics: Vec<[bool; 12]>,
    pub features: Vec<[bool; 3]>,
    /// Tips that are held, where tips are free.
    pub tips: Vec<bool>,
}

/// Gaussian priors: means, and standard deviations per coordinate, infinite where nothing is known.
#[derive(Clone, Debug)]
pub(crate) struct Priors {
    pub mean: Model,
    pub base: [f64; 6],
    pub parameters: Vec<f64>,
    pub cameras: Vec<[f64; 6]>,
    pub intrinsics: Vec<[f64; 12]>,
    pub features: Vec<[f64; 3]>,
}

/// A graph and the names of its nodes.
pub(crate) struct Built {
    pub graph: Graph,
    pub base: Key<Pose>,
    pub parameters: Key<DynamicVector>,
    pub cameras: Vec<(Key<Pose>, Key<Intrinsics>)>,
    pub features: Vec<Key<Vector<3>>>,
    pub tips: Vec<Option<Key<Pose>>>,
    /// The factor of each observation that takes part.
    pub factors: Vec<(usize, FactorKey)>,
}

impl Freedom {
    /// Everything free, with the chain or without.
    pub fn all(setup: &Setup, chain: bool) -> Freedom {
        let unused = |camera: &crate::rig::ModelCamera| {
            let count = 4 + camera.model.distortion().len();
            std::array::from_fn(|i| i >= count)
        };
        let model = &setup.model;
        Freedom {
            chain,
            base: [false; 6],
            parameters: vec![false; model.parameters.len()],
            cameras: vec![[false; 6]; model.cameras.len()],
            intrinsics: model.cameras.iter().map(unused).collect(),
            features: vec![[false; 3]; model.features.len()],
            tips: vec![false; setup.joints.len()],
        }
    }
}

impl Freedom {
    /// Everything held, end to end.
    pub fn nothing(setup: &Setup) -> Freedom {
        let all = Freedom::all(setup, true);
        Freedom {
            base: [true; 6],
            parameters: vec![true; all.parameters.len()],
            cameras: vec![[true; 6]; all.cameras.len()],
            intrinsics: vec![[true; 12]; all.intrinsics.len()],
            features: vec![[true; 3]; all.features.len()],
            ..all
        }
    }
}

/// Builds the graph over the observations for which `takes_part` says so.
pub(crate) fn build(
    setup: &Setup,
    state: &State,
    freedom: &Freedom,
    priors: &Priors,
    loss: Loss,
    takes_part: impl Fn(usize) -> bool,
) -> Built {
    let model = &state.model;
    let mut graph = Graph::new();
    let base = graph.free(model.base);
    hold(&mut graph, base, &freedom.base);
    let parameters = graph.free(DynamicVector::from_column_slice(&model.parameters));
    hold(&mut graph, parameters, &freedom.parameters);
    let mut cameras = Vec::new();
    for (index, camera) in model.cameras.iter().enumerate() {
        let pose = graph.free(camera.pose);
        hold(&mut graph, pose, &freedom.cameras[index]);
        let intrinsics = graph.free(Intrinsics::from(camera.intrinsics));
        hold(&mut graph, intrinsics, &freedom.intrinsics[index]);
        cameras.push((pose, intrinsics));
    }
    let features: Vec<_> = model
        .features
        .iter()
        .zip(&freedom.features)
        .map(|(feature, held)| {
            let key = graph.free(feature.xyz);
            hold(&mut graph, key, held);
            key
        })
        .collect();
    let world = graph.held(Pose::identity());
    let chain = Arc::new(model.chain.clone());
    let n = chain.len();
    let mut tips = vec![None; setup.joints.len()];
    let mut factors = Vec::new();
    let mut sample = usize::MAX;
    let mut links: Vec<Option<Key<Pose>>> = Vec::new();
    let mut joints = None;
    for (index, observation) in setup.observations.iter().enumerate().filter(|(index, _)| takes_part(*index)) {
        if observation.sample != sample {
            sample = observation.sample;
            links = vec![None; n + 1];
            joints = None;
        }
        let mut carrier = |parent: Parent, graph: &mut Graph| match parent {
            Parent::World => world,
            Parent::Tip if !freedom.chain => *tips[sample].get_or_insert_with(|| {
                let tip = graph.free(state.tips[sample]);
                if freedom.tips[sample] {
                    graph.hold(tip);
                }
                tip
            }),
            Parent::Tip | Parent::Link(_) => {
                let upto = if let Parent::Link(joint) = parent { joint + 1 } else { n };
                let joints =
                    *joints.get_or_insert_with(|| graph.held(DynamicVector::from_column_slice(&setup.joints[sample])));
                let link = *links[upto].get_or_insert_with(|| {
                    graph.derive(ForwardKinematics { chain: chain.clone(), upto }, (base, parameters, joints))
                });
                if upto == n {
                    tips[sample] = Some(link);
                }
                link
            }
        };
        let (camera, feature) = (&model.cameras[observation.camera], &model.features[observation.feature]);
        let (carrier, mount) = (carrier(feature.parent, &mut graph), carrier(camera.parent, &mut graph));
        let (pose, intrinsics) = cameras[observation.camera];
        let factor = Reprojection { pixel: observation.pixel, model: camera.model };
        let settings = graph
            .factor(factor, (carrier, features[observation.feature], mount, pose, intrinsics))
            .sigma(setup.sigma())
            .loss(loss);
        factors.push((index, settings.key));
    }
    let mut built = Built { graph, base, parameters, cameras, features, tips, factors };
    built.add_priors(priors, freedom);
    built
}

impl Built {
    fn add_priors(&mut self, priors: &Priors, freedom: &Freedom) {
        let graph = &mut self.graph;
        let some = |sigmas: &[f64]| sigmas.iter().any(|sigma| sigma.is_finite());
        if freedom.chain {
            if some(&priors.base) {
                graph.prior(self.base, &priors.mean.base, &priors.base);
            }
            if some(&priors.parameters) {
                let mean = DynamicVector::from_column_slice(&priors.mean.parameters);
                graph.prior(self.parameters, &mean, &priors.parameters);
            }
        }
        for (index, &(pose, intrinsics)) in self.cameras.iter().enumerate() {
            let mean = &priors.mean.cameras[index];
            // Without the chain, the world is not yet where the given poses are.
            if freedom.chain && some(&priors.cameras[index]) {
                graph.prior(pose, &mean.pose, &priors.cameras[index]);
            }
            if some(&priors.intrinsics[index]) {
                graph.prior(intrinsics, &Intrinsics::from(mean.intrinsics), &priors.intrinsics[index]);
            }
        }
        for (index, &feature) in self.features.iter().enumerate() {
            if freedom.chain && some(&priors.features[index]) {
                graph.prior(feature, &priors.mean.features[index].xyz, &priors.features[index]);
            }
        }
    }

    /// Takes the graph's values over.
    pub fn read(&self, state: &mut State) {
        let model = &mut state.model;
        model.base = self.graph.value(self.base);
        model.parameters.copy_from_slice(self.graph.value(self.parameters).as_slice());
        for (camera, &(pose, intrinsics)) in model.cameras.iter_mut().zip(&self.cameras) {
            camera.pose = self.graph.value(pose);
            camera.intrinsics.copy_from_slice(self.graph.value(intrinsics).as_slice());
        }
        for (feature, &key) in model.features.iter_mut().zip(&self.features) {
            feature.xyz = self.graph.value(key);
        }
        for (tip, key) in state.tips.iter_mut().zip(&self.tips) {
            if let Some(key) = key {
                *tip = self.graph.value(*key);
            }
        }
    }
}

fn hold<V>(graph: &mut Graph, key: Key<V>, held: &[bool]) {
    let coordinates: Vec<usize> = held.iter().enumerate().filter(|(_, held)| **held).map(|(i, _)| i).collect();
    if coordinates.len() == held.len() {
        graph.hold(key);
    } else if !coordinates.is_empty() {
        graph.hold_coordinates(key, &coordinates);
    }
}

/// Index of the first of the chain's parameters of a joint.
pub(crate) fn row(joint: usize) -> usize {
    LINK_PARAMETERS * joint
}
