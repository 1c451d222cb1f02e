//! The graph of a calibration: which nodes are free is a table, the factors are the same for every stage.
use super::cameras::KnownIntrinsics;
use super::lengths;
use super::observation::Place;
use super::setup::Setup;
use super::states::Start;
use super::trunk::Trunk;
use crate::chain::LINK_PARAMETERS;
use crate::factors::{Intrinsics, PointObservation, Reprojection};
use crate::rig::Model;
use handeye_solvers::{DynamicVector, FactorKey, Graph, Key, Loss, Pose, Vector};

/// Where everything is now.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Chain, cameras and features.
    pub model: Model,
    /// `world_from_tip` of every sample, for the stages in which tips are not derived.
    pub tips: Vec<Pose>,
    /// Joints of every sample, where there is a chain.
    pub joints: Vec<Vec<f64>>,
    /// Of what recorded poses are, `tip_from_tool`: the frame of a learned chain's tip is not that of the recorded poses.
    pub tool: Pose,
    /// Whether a joint reading takes part; a wrong one is let go of.
    pub trusted: Vec<bool>,
    /// Whether the state of a sample is known well enough to take part.
    pub placed: Vec<bool>,
}

impl State {
    /// At what is known before anything is learned.
    pub fn new(setup: &Setup) -> State {
        let n = setup.model.chain.len();
        let starts = &setup.states.starts;
        let tip = |start: &Option<Start>| if let Some(Start::Tip(tip)) = start { *tip } else { Pose::identity() };
        let joints = |start: &Option<Start>| {
            start.as_ref().and_then(Start::joints).map_or_else(|| vec![0.0; n], <[f64]>::to_vec)
        };
        State {
            model: setup.model.clone(),
            tips: starts.iter().map(tip).collect(),
            joints: starts.iter().map(joints).collect(),
            tool: Pose::identity(),
            trusted: vec![true; starts.len()],
            placed: starts.iter().map(Option::is_some).collect(),
        }
    }

    /// Poses of the links of a sample, as [`Model::links`] has them; without joints, of base and tip.
    pub fn links(&self, setup: &Setup, sample: usize) -> Vec<Pose> {
        if setup.states.chain {
            self.model.links(&self.joints[sample])
        } else {
            vec![self.model.base, self.tips[sample]]
        }
    }

    /// The same of all samples.
    pub fn all_links(&self, setup: &Setup) -> Vec<Vec<Pose>> {
        (0..setup.len()).map(|sample| self.links(setup, sample)).collect()
    }
}

/// Where a stage has the poses of the tip from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tips {
    /// The images alone, in a world of their own.
    Seen,
    /// The chain, from the joints.
    Chain,
    /// Their readings, or commanded motions.
    Read,
}

/// What is free, and what is known of it. Where a list is indexed by coordinate, true means held.
#[derive(Clone, Debug)]
pub(crate) struct Freedom {
    /// Where the tips come from.
    pub source: Tips,
    /// Coordinates of the base's step, of the chain's parameters, of each camera's step and intrinsics, of each feature.
    pub base: [bool; 6],
    pub parameters: Vec<bool>,
    pub cameras: Vec<[bool; 6]>,
    pub intrinsics: Vec<[bool; 12]>,
    pub features: Vec<[bool; 3]>,
    /// Samples whose tip, or whose joints where there is a chain, are held.
    pub states: Vec<bool>,
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
    pub joints: Vec<Option<Key<DynamicVector>>>,
    pub tool: Key<Pose>,
    /// The factor of each observation that takes part.
    pub factors: Vec<(usize, FactorKey)>,
    /// Factors of what is known beside the recording: of the robot, the cameras, the features, and lengths that were measured.
    pub known: [Vec<FactorKey>; 4],
}

impl Freedom {
    /// Everything free but states that are known exactly.
    pub fn all(setup: &Setup) -> Freedom {
        let unused = |(camera, known): (&crate::rig::ModelCamera, &KnownIntrinsics)| {
            let count = 4 + camera.model.distortion().len();
            std::array::from_fn(|i| known.unused || i >= count)
        };
        let model = &setup.model;
        Freedom {
            source: if setup.states.chain { Tips::Chain } else { Tips::Read },
            base: [false; 6],
            parameters: vec![false; model.parameters.len()],
            cameras: vec![[false; 6]; model.cameras.len()],
            intrinsics: model.cameras.iter().zip(&setup.intrinsics).map(unused).collect(),
            features: vec![[false; 3]; model.features.len()],
            states: setup.states.exact.clone(),
        }
    }

    /// The same without the chain, from the images alone.
    pub fn seen(setup: &Setup) -> Freedom {
        Freedom { source: Tips::Seen, states: vec![false; setup.len()], ..Freedom::all(setup) }
    }

    /// Everything held.
    pub fn nothing(setup: &Setup) -> Freedom {
        let all = Freedom::all(setup);
        Freedom {
            base: [true; 6],
            parameters: vec![true; all.parameters.len()],
            cameras: vec![[true; 6]; all.cameras.len()],
            intrinsics: vec![[true; 12]; all.intrinsics.len()],
            features: vec![[true; 3]; all.features.len()],
            states: vec![true; all.states.len()],
            ..all
        }
    }
}

/// Builds the graph over the observations for which `takes_part` says so, of samples whose state is placed.
pub(crate) fn build(
    setup: &Setup,
    state: &State,
    freedom: &Freedom,
    priors: &Priors,
    loss: Loss,
    takes_part: impl Fn(usize) -> bool,
) -> Built {
    let mut built = Built::rig(state, freedom);
    if !(setup.tool_is_open() && freedom.source == Tips::Chain) {
        built.graph.hold(built.tool);
    }
    let mut trunk = Trunk::new(setup, state, freedom, &mut built);
    let model = &state.model;
    for (index, seen) in setup.observations.iter().enumerate() {
        let placed = freedom.source == Tips::Seen || state.placed[seen.sample];
        if !placed || !takes_part(index) {
            continue;
        }
        let (camera, feature) = (&model.cameras[seen.camera], &model.features[seen.feature]);
        let carrier = trunk.carrier(feature.parent, seen.sample, &mut built);
        let mount = trunk.carrier(camera.parent, seen.sample, &mut built);
        let (pose, intrinsics) = built.cameras[seen.camera];
        let (feature, sd) = (built.features[seen.feature], setup.sd(seen.kind()));
        let key = match seen.place {
            Place::Pixel(pixel) => {
                let factor = Reprojection { pixel, model: camera.model };
                built.graph.factor(factor, (carrier, feature, mount, pose, intrinsics)).sigma(sd).loss(loss).key
            }
            Place::Point(point) => {
                let on = (carrier, feature, mount, pose);
                built.graph.factor(PointObservation { point }, on).sigma(sd).loss(loss).key
            }
        };
        built.factors.push((index, key));
    }
    if freedom.source != Tips::Seen {
        trunk.measure(loss, &mut built);
        lengths::measure(setup, loss, &mut built);
    }
    built.add_priors(priors, freedom);
    built
}

impl Built {
    /// The nodes of the rig, without samples.
    fn rig(state: &State, freedom: &Freedom) -> Built {
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
        let mut features = Vec::new();
        for (feature, held) in model.features.iter().zip(&freedom.features) {
            let key = graph.free(feature.xyz);
            hold(&mut graph, key, held);
            features.push(key);
        }
        let n = state.tips.len();
        let tool = graph.free(state.tool);
        let (tips, joints, factors) = (vec![None; n], vec![None; n], Vec::new());
        let known = Default::default();
        Built { graph, base, parameters, cameras, features, tips, joints, tool, factors, known }
    }

    fn add_priors(&mut self, priors: &Priors, freedom: &Freedom) {
        let graph = &mut self.graph;
        let [of_robot, of_cameras, of_features, _] = &mut self.known;
        let some = |sigmas: &[f64]| sigmas.iter().any(|sigma| sigma.is_finite());
        if freedom.source == Tips::Chain {
            if some(&priors.base) {
                of_robot.push(graph.prior(self.base, &priors.mean.base, &priors.base));
            }
            if some(&priors.parameters) {
                let mean = DynamicVector::from_column_slice(&priors.mean.parameters);
                of_robot.push(graph.prior(self.parameters, &mean, &priors.parameters));
            }
        }
        for (index, &(pose, intrinsics)) in self.cameras.iter().enumerate() {
            let mean = &priors.mean.cameras[index];
            // Without the chain, the world is not yet where the given poses are.
            if freedom.source != Tips::Seen && some(&priors.cameras[index]) {
                of_cameras.push(graph.prior(pose, &mean.pose, &priors.cameras[index]));
            }
            if some(&priors.intrinsics[index]) {
                let mean = Intrinsics::from(mean.intrinsics);
                of_cameras.push(graph.prior(intrinsics, &mean, &priors.intrinsics[index]));
            }
        }
        for (index, &feature) in self.features.iter().enumerate() {
            if freedom.source != Tips::Seen && some(&priors.features[index]) {
                of_features.push(graph.prior(feature, &priors.mean.features[index].xyz, &priors.features[index]));
            }
        }
    }

    /// Nodes of the samples: joints and tips.
    pub fn states(&self) -> Vec<usize> {
        let joints = self.joints.iter().flatten().map(|key| key.index());
        joints.chain(self.tips.iter().flatten().map(|key| key.index())).collect()
    }

    /// Takes the graph's values over.
    pub fn read(&self, state: &mut State) {
        state.tool = self.graph.value(self.tool);
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
        for (joints, key) in state.joints.iter_mut().zip(&self.joints) {
            if let Some(key) = key {
                joints.copy_from_slice(self.graph.value(*key).as_slice());
            }
        }
    }
}

pub(crate) fn hold<V>(graph: &mut Graph, key: Key<V>, held: &[bool]) {
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
