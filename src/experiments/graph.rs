//! The generative model as a factor graph of which any part is free: what the losses of the paper have in common.
use crate::Error;
use crate::factors::{ForwardKinematics, Intrinsics, Reprojection};
use crate::recording::Recording;
use crate::rig::{Model, Parent, Rig};
use handeye_solvers::{DynamicVector, Graph, Key, Pose, Vector, Workspace};
use std::sync::Arc;

/// Numbers of a row of the chain.
const ROW: usize = crate::chain::LINK_PARAMETERS;

/// How well the intrinsics of a recording's header are known, where they are free: shares of the focal length and of twice
/// the principal point, which is about the size of the image.
const FOCAL: f64 = 0.03;
const CENTRE: f64 = 0.02;

/// What the readings of the joints say of the joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Readings {
    /// They are the joints (eq. 6).
    Exact,
    /// They are where to begin, and nothing else.
    Start,
}

/// What is estimated; the rest is held.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free<'a> {
    pub base: bool,
    pub chain: bool,
    pub features: bool,
    /// Poses and intrinsics of the cameras with these indices.
    pub cameras: &'a [usize],
    pub joints: Readings,
}

/// Nothing is free.
pub(super) const HELD: Free<'static> =
    Free { base: false, chain: false, features: false, cameras: &[], joints: Readings::Exact };

/// A graph and where the parts of the model are in it.
pub(super) struct Problem {
    pub graph: Graph,
    /// Detections that take part.
    pub detections: usize,
    base: Key<Pose>,
    parameters: Key<DynamicVector>,
    cameras: Vec<(Key<Pose>, Key<Intrinsics>)>,
    features: Vec<Key<Vector<3>>>,
    joints: Vec<Key<DynamicVector>>,
}

impl Problem {
    /// Every detection of cameras and features that the rig names, in samples with joints; the model, which is one of that
    /// rig, is where it starts. Features are on the tip and cameras in the world.
    pub fn new(rig: &Rig, model: &Model, recording: &Recording, free: &Free<'_>) -> Result<Problem, Error> {
        let elsewhere = model.cameras.iter().any(|camera| camera.parent != Parent::World)
            || model.features.iter().any(|feature| feature.parent != Parent::Tip);
        if elsewhere {
            return Err(Error::Unusable("an experiment has cameras in the world and features on the tip".to_owned()));
        }
        let mut graph = Graph::new();
        let base = graph.free(model.base);
        let parameters = graph.free(DynamicVector::from_column_slice(&model.parameters));
        hold_stand_ins(&mut graph, parameters, rig);
        let mut cameras = Vec::new();
        for (index, camera) in model.cameras.iter().enumerate() {
            let keys = (graph.free(camera.pose), graph.free(Intrinsics::from(camera.intrinsics)));
            if free.cameras.contains(&index) {
                free_intrinsics(&mut graph, keys.1, &rig.cameras[index].name, recording);
            } else {
                graph.hold(keys.0);
                graph.hold(keys.1);
            }
            cameras.push(keys);
        }
        let features: Vec<_> = model.features.iter().map(|feature| graph.free(feature.xyz)).collect();
        if !free.base {
            graph.hold(base);
        }
        if !free.chain {
            graph.hold(parameters);
        }
        if !free.features {
            features.iter().for_each(|&feature| graph.hold(feature));
        }
        let mut problem = Problem { graph, detections: 0, base, parameters, cameras, features, joints: Vec::new() };
        problem.add_samples(rig, model, recording, free.joints);
        Ok(problem)
    }

    fn add_samples(&mut self, rig: &Rig, model: &Model, recording: &Recording, readings: Readings) {
        let camera = |name: &str| rig.cameras.iter().position(|camera| camera.name == name);
        let feature = |name: &str| rig.features.iter().position(|feature| feature.name == name);
        let camera_of: Vec<_> = recording.cameras.iter().map(|recorded| camera(&recorded.name)).collect();
        let feature_of: Vec<_> = recording.features.iter().map(|name| feature(name)).collect();
        let world = self.graph.held(Pose::identity());
        let chain = Arc::new(model.chain.clone());
        for sample in &recording.samples {
            let Some(read) = &sample.joints else { continue };
            let read = DynamicVector::from_column_slice(read);
            let joints = self.graph.free(read);
            if readings == Readings::Exact {
                self.graph.hold(joints);
            }
            self.joints.push(joints);
            let kinematics = ForwardKinematics { chain: chain.clone(), upto: chain.len() };
            let tip = self.graph.derive(kinematics, (self.base, self.parameters, joints));
            for detection in &sample.pixels {
                let (camera, feature) = (camera_of[detection.camera as usize], feature_of[detection.feature as usize]);
                let (Some(camera), Some(feature)) = (camera, feature) else { continue };
                let (pose, intrinsics) = self.cameras[camera];
                let factor = Reprojection { pixel: detection.pixel, model: model.cameras[camera].model };
                let on = (tip, self.features[feature], world, pose, intrinsics);
                self.graph.factor(factor, on).sigma(rig.noise.pixels);
                self.detections += 1;
            }
        }
    }

    /// Takes the graph's values over.
    pub fn read(&self, model: &mut Model) {
        model.base = self.graph.value(self.base);
        model.parameters.copy_from_slice(self.graph.value(self.parameters).as_slice());
        for (camera, &(pose, intrinsics)) in model.cameras.iter_mut().zip(&self.cameras) {
            camera.pose = self.graph.value(pose);
            camera.intrinsics.copy_from_slice(self.graph.value(intrinsics).as_slice());
        }
        for (feature, &key) in model.features.iter_mut().zip(&self.features) {
            feature.xyz = self.graph.value(key);
        }
    }

    /// The joints of every sample that has readings [rad].
    pub fn joints(&self) -> Vec<Vec<f64>> {
        self.joints.iter().map(|&key| self.graph.value(key).as_slice().to_vec()).collect()
    }

    /// Norm of the gradient of the whitened loss, Σ |r/σ|²/2, in rad, m and px of what is free.
    pub fn gradient_norm(&self) -> f64 {
        let mut workspace = Workspace::new(&self.graph);
        workspace.linearize_at(&self.graph);
        workspace.normal_equations().1.norm()
    }
}

/// A joint has either β or, where it stands in for it, d.
fn hold_stand_ins(graph: &mut Graph, parameters: Key<DynamicVector>, rig: &Rig) {
    let held = rig.robot.joints.iter().enumerate();
    let held = held.map(|(joint, row)| ROW * joint + if row.beta.is_some() { 1 } else { 4 });
    graph.hold_coordinates(parameters, &held.collect::<Vec<_>>());
}

/// Focal lengths and principal point are free around the header's; distortion is held.
fn free_intrinsics(graph: &mut Graph, intrinsics: Key<Intrinsics>, name: &str, recording: &Recording) {
    graph.hold_coordinates(intrinsics, &(4..12).collect::<Vec<_>>());
    let Some(header) = recording.cameras.iter().find(|camera| camera.name == name) else { return };
    let (Some(fx), Some(fy), Some(cx), Some(cy)) = (header.fx, header.fy, header.cx, header.cy) else { return };
    let (mut mean, mut sigmas) = (graph.value(intrinsics), [f64::INFINITY; 12]);
    for (index, (value, sd)) in
        [(fx, FOCAL * fx), (fy, FOCAL * fy), (cx, CENTRE * 2.0 * cx), (cy, CENTRE * 2.0 * cx)].into_iter().enumerate()
    {
        mean[index] = value;
        sigmas[index] = sd;
    }
    graph.prior(intrinsics, &mean, &sigmas);
}

/// The rig with the numbers of a model of it.
pub(super) fn with_model(rig: &Rig, model: &Model) -> Rig {
    let mut rig = rig.clone();
    rig.robot.base = Some(model.base);
    for (joint, row) in rig.robot.joints.iter_mut().zip(model.parameters.chunks_exact(ROW)) {
        (joint.offset, joint.d, joint.a, joint.alpha) = (Some(row[0]), Some(row[1]), Some(row[2]), Some(row[3]));
        joint.beta = joint.beta.map(|_| row[4]);
    }
    for (camera, learned) in rig.cameras.iter_mut().zip(&model.cameras) {
        let [fx, fy, cx, cy, ..] = learned.intrinsics;
        (camera.fx, camera.fy, camera.cx, camera.cy) = (Some(fx), Some(fy), Some(cx), Some(cy));
        camera.pose = Some(learned.pose);
    }
    for (feature, learned) in rig.features.iter_mut().zip(&model.features) {
        feature.xyz = Some(learned.xyz.into());
    }
    rig
}
