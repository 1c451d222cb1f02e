//! The factor graph of targets: a table of free, held and derived nodes.
use super::moments::chain_of;
use super::setup::Setup;
use crate::Error;
use crate::chain::LINK_PARAMETERS;
use crate::factors::{CameraFromTarget, Drifting, ForwardKinematics};
use crate::rig::{JointField, Parameter, Parent};
use handeye_solvers::{DynamicVector, Graph, Key, LevenbergMarquardt, Loss, Pose, Report, Solver, Termination, Vector};
use std::sync::Arc;

/// Where everything is.
#[derive(Clone)]
pub(super) struct State {
    pub cameras: Vec<Pose>,
    pub targets: Vec<Pose>,
    pub base: Pose,
    pub parameters: Vec<f64>,
    pub tips: Vec<Pose>,
    /// Clock of the images ahead of the robot's [s].
    pub offset: f64,
    /// Of the reported translations.
    pub scale: f64,
    /// Standard deviations of a target's pose in its camera: rotation [rad], then translation [m].
    pub sigmas: [f64; 6],
    /// By how much reports drift from one view of a target to the next: standard deviations of rotations [rad] and translations [m].
    pub walks: [f64; 2],
    /// The drift of each view: rotation [rad], then translation [m].
    pub drifts: Vec<[f64; 6]>,
    /// How far the chain's given values are off [rad, m], where the rig does not say.
    pub spread: [f64; 2],
    /// The share of the views' noise that their residuals show, by coordinate, in standard deviations: what is free takes up the rest.
    pub shown: [f64; 6],
}

/// Which scalars are free besides the poses.
#[derive(Clone, Copy)]
pub(super) struct Freedom {
    pub offset: bool,
    pub scale: bool,
}

pub(super) struct Built {
    pub graph: Graph,
    pub cameras: Vec<Key<Pose>>,
    pub targets: Vec<Key<Pose>>,
    pub parameters: Option<Key<DynamicVector>>,
    /// `camera_from_target` of each view as predicted.
    pub predicted: Vec<Key<Pose>>,
    tips: Vec<Key<Pose>>,
    drifts: Vec<Key<Vector<6>>>,
    pub offset: Key<Vector<1>>,
    pub scale: Key<Vector<1>>,
}

/// What is mounted is this near to what it is mounted on, and what stands in the world this near to its origin [m]: so weak a
/// prior matters only where the motions leave a direction open.
const NEAR_TIP: f64 = 0.3;
const NEAR_ORIGIN: f64 = 10.0;

/// So far off a given pose may be where nothing is said of how well it is known [rad, m].
const GIVEN_ANGLE: f64 = 0.1;
const GIVEN_LENGTH: f64 = 0.1;

/// Most iterations of the minimiser.
const ITERATIONS: usize = 100;

pub(super) fn build(setup: &Setup, state: &State, freedom: Freedom, loss: Loss) -> Built {
    let mut graph = Graph::new();
    let offset = graph.free(Vector::<1>::new(state.offset));
    let scale = graph.free(Vector::<1>::new(state.scale));
    if !freedom.offset {
        graph.hold(offset);
    }
    if !freedom.scale {
        graph.hold(scale);
    }
    let cameras: Vec<_> = state.cameras.iter().map(|pose| graph.free(*pose)).collect();
    let targets: Vec<_> = state.targets.iter().map(|pose| graph.free(*pose)).collect();
    let rig = &setup.rig;
    for (index, (key, camera)) in cameras.iter().zip(&rig.cameras).enumerate() {
        prior(&mut graph, setup, *key, Parameter::CameraPose(index), camera.pose, camera.parent);
    }
    for (index, (key, target)) in targets.iter().zip(&rig.targets).enumerate() {
        prior(&mut graph, setup, *key, Parameter::TargetPose(index), target.pose, target.parent);
    }
    let (tips, parameters) = tips(&mut graph, setup, state, offset);
    let world = graph.held(Pose::identity());
    let carrier = |parent: Parent, moment: usize| if parent == Parent::World { world } else { tips[moment] };
    let still = graph.held(Vector::<6>::zeros());
    let (mut drifts, mut predicted) = (Vec::with_capacity(setup.views.len()), Vec::with_capacity(setup.views.len()));
    for (index, view) in setup.views.iter().enumerate() {
        let mount = carrier(rig.cameras[view.camera].parent, view.moment);
        let below = carrier(rig.targets[view.target].parent, view.moment);
        let seen = graph.derive(CameraFromTarget, (below, targets[view.target], mount, cameras[view.camera]));
        let drift = match view.before.filter(|_| state.walks != [0.0; 2]) {
            Some(before) => drifting(&mut graph, drifts[before], state, index),
            None => still,
        };
        drifts.push(drift);
        predicted.push(seen);
        let factor = graph.factor(setup.seen(index), (seen, scale, drift)).loss(loss);
        match view.whitening {
            Some(whitening) => factor.whitening(whitening),
            None => factor.sigmas(state.sigmas),
        };
    }
    Built { graph, cameras, targets, parameters, predicted, tips, drifts, offset, scale }
}

/// A drift that walks on from the one before.
fn drifting(graph: &mut Graph, before: Key<Vector<6>>, state: &State, index: usize) -> Key<Vector<6>> {
    let drift = graph.free(Vector::from(state.drifts[index]));
    let still: Vec<usize> = (0..6).filter(|k| state.walks[k / 3] == 0.0).collect();
    graph.hold_coordinates(drift, &still);
    let sigmas = std::array::from_fn(|k| if state.walks[k / 3] > 0.0 { state.walks[k / 3] } else { 1.0 });
    graph.factor(Drifting, (before, drift)).sigmas(sigmas);
    drift
}

/// Tips derived from joints and chain, free under the noise of their readings, derived from the offset, or held.
fn tips(
    graph: &mut Graph,
    setup: &Setup,
    state: &State,
    offset: Key<Vector<1>>,
) -> (Vec<Key<Pose>>, Option<Key<DynamicVector>>) {
    let noise = &setup.rig.noise;
    if let Some(model) = chain_of(&setup.rig).filter(|_| setup.by_joints) {
        let base = graph.held(state.base);
        let parameters = graph.free(DynamicVector::from_column_slice(&state.parameters));
        let (held, sigmas) = known_parameters(setup, state.spread);
        graph.hold_coordinates(parameters, &held);
        graph.prior(parameters, &DynamicVector::from_column_slice(&model.parameters), &sigmas);
        let chain = Arc::new(model.chain.clone());
        let n = chain.len();
        let tip = |moment: &super::moments::Moment| {
            let readings = moment.joints.clone()?;
            let read = readings.joints.coefficients[0].clone();
            let joints = if noise.joints > 0.0 && !setup.apart {
                let joints = graph.free(DynamicVector::from_column_slice(&read));
                graph.prior(joints, &DynamicVector::from_column_slice(&read), &vec![noise.joints; n]);
                joints
            } else {
                graph.derive(readings, (offset,))
            };
            Some(graph.derive(ForwardKinematics { chain: chain.clone(), upto: n }, (base, parameters, joints)))
        };
        return (setup.moments.iter().filter_map(tip).collect(), Some(parameters));
    }
    let noisy = noise.pose.xyz > 0.0 || noise.pose.rot > 0.0;
    let [rot, xyz] = [noise.pose.rot.max(1e-6), noise.pose.xyz.max(1e-6)];
    let mut keys = Vec::with_capacity(setup.moments.len());
    for (moment, tip) in setup.moments.iter().zip(&state.tips) {
        if noisy {
            let key = graph.free(*tip);
            graph.factor::<_, 6>(moment.pose.clone(), (key, offset)).sigmas([rot, rot, rot, xyz, xyz, xyz]);
            keys.push(key);
        } else {
            keys.push(graph.derive(moment.pose.clone(), (offset,)));
        }
    }
    (keys, None)
}

/// Around a given pose its prior; elsewhere the weak one that decides what motions leave open.
fn prior(graph: &mut Graph, setup: &Setup, key: Key<Pose>, parameter: Parameter, given: Option<Pose>, parent: Parent) {
    let rig = &setup.rig;
    if given.is_some() && rig.is_fixed(&parameter) {
        return graph.hold(key);
    }
    let sigmas = |angle: f64, length: f64| [angle, angle, angle, length, length, length];
    match given {
        Some(pose) => {
            let sd = rig.prior_sd(&parameter);
            graph.prior(key, &pose, &sigmas(sd.unwrap_or(GIVEN_ANGLE), sd.unwrap_or(GIVEN_LENGTH)));
        }
        None => {
            let near = if parent == Parent::World { NEAR_ORIGIN } else { NEAR_TIP };
            graph.prior(key, &Pose::identity(), &sigmas(f64::INFINITY, near));
        }
    }
}

/// Coordinates of the chain's parameters that are held, and standard deviations of all.
fn known_parameters(setup: &Setup, [angle, length]: [f64; 2]) -> (Vec<usize>, Vec<f64>) {
    let rig = &setup.rig;
    let (mut held, mut sigmas) = (Vec::new(), Vec::new());
    for (joint, row) in rig.robot.joints.iter().enumerate() {
        for (k, &field) in JointField::ALL.iter().enumerate() {
            let parameter = Parameter::JointField { joint, field };
            let is_length = matches!(field, JointField::D | JointField::A);
            if rig.is_fixed(&parameter) || (field == JointField::Beta && row.beta.is_none()) {
                held.push(LINK_PARAMETERS * joint + k);
            }
            sigmas.push(rig.prior_sd(&parameter).unwrap_or(if is_length { length } else { angle }));
        }
    }
    (held, sigmas)
}

impl Built {
    /// Minimises, and moves the state there.
    pub fn minimize(&mut self, state: &mut State) -> Result<(Report, Solver), Error> {
        let mut solver = Solver::new(&self.graph);
        let minimizer = LevenbergMarquardt { max_iterations: ITERATIONS, ..Default::default() };
        let report =
            minimizer.minimize_with(&mut self.graph, &mut solver, &mut |_| std::ops::ControlFlow::Continue(()))?;
        if report.termination == Termination::Cancelled {
            return Err(Error::Cancelled);
        }
        let graph = &self.graph;
        let poses = |keys: &[Key<Pose>]| keys.iter().map(|key| graph.value(*key)).collect::<Vec<_>>();
        (state.cameras, state.targets, state.tips) = (poses(&self.cameras), poses(&self.targets), poses(&self.tips));
        state.drifts = self.drifts.iter().map(|key| graph.value(*key).into()).collect();
        state.offset = graph.value(self.offset)[0];
        state.scale = graph.value(self.scale)[0];
        if let Some(parameters) = self.parameters {
            state.parameters = graph.value(parameters).as_slice().to_vec();
        }
        Ok((report, solver))
    }
}
