//! Explanations: one part of the rig moved, and everything else is where it was.
use super::null::Image;
use super::seen::Seen;
use crate::Error;
use crate::calibrate::displaced_by_joint;
use crate::chain::{JointKind, LINK_PARAMETERS};
use crate::factors::{ForwardKinematics, Intrinsics, Reprojection};
use crate::rig::{Model, Parent, Rig};
use handeye_solvers::{DynamicVector, Function, Graph, Key, LevenbergMarquardt, Loss, Pose, Scalar, Vector, Workspace};
use std::fmt;
use std::sync::Arc;

/// What moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// This camera of the rig, in what it is fixed to.
    Camera(usize),
    /// All features on the tip, as one body.
    Structure,
    /// The base of the robot in the world.
    Base,
    /// The zero of this joint of the rig.
    Joint(usize),
    /// No single part: more than one moved, or something that the rig does not have.
    Unexplained,
}

/// How well an explanation does.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The explanation.
    pub cause: Cause,
    /// -2 log likelihood and a price of ln N per degree of freedom (BIC); smaller is better.
    pub bic: f64,
    /// Median pixel distance of the samples since the change, explained so [px].
    pub median_px: f64,
}

impl Cause {
    /// As people call it, with the names of the rig.
    pub fn name(&self, rig: &Rig) -> String {
        match *self {
            Cause::Camera(camera) => format!("camera {}", rig.cameras[camera].name),
            Cause::Structure => "structure".to_owned(),
            Cause::Base => "base".to_owned(),
            Cause::Joint(joint) => format!("joint {}", rig.robot.joints[joint].name),
            Cause::Unexplained => "no single part".to_owned(),
        }
    }

    /// Degrees of freedom.
    pub(super) fn freedom(&self) -> f64 {
        match self {
            Cause::Camera(_) | Cause::Structure | Cause::Base => 6.0,
            Cause::Joint(_) => 1.0,
            Cause::Unexplained => 0.0,
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::Camera(camera) => write!(f, "camera {camera}"),
            Cause::Structure => f.write_str("structure"),
            Cause::Base => f.write_str("base"),
            Cause::Joint(joint) => write!(f, "joint {joint}"),
            Cause::Unexplained => f.write_str("no single part"),
        }
    }
}

/// All explanations of a rig; of those that explain equally well, the earlier is preferred.
pub(super) fn causes(model: &Model) -> Vec<Cause> {
    let joints = (0..model.chain.len()).map(Cause::Joint);
    let cameras = (0..model.cameras.len()).map(Cause::Camera);
    let on_tip = model.features.iter().any(|feature| feature.parent == Parent::Tip);
    joints.chain(cameras).chain(on_tip.then_some(Cause::Structure)).chain([Cause::Base]).collect()
}

/// world_from_tip · tip_from_structure.
struct Attached;

impl Function for Attached {
    type On = (Pose, Pose);
    type Output = Pose;

    fn compute<T: Scalar>(&self, (tip, structure): (Pose<T>, Pose<T>)) -> Pose<T> {
        tip * structure
    }
}

/// A model on some samples, of which one part or all may be free.
pub(super) struct Problem {
    graph: Graph,
    base: Key<Pose>,
    parameters: Key<DynamicVector>,
    structure: Key<Pose>,
    cameras: Vec<(Key<Pose>, Key<Intrinsics>)>,
    features: Vec<Key<Vector<3>>>,
    detections: usize,
}

impl Problem {
    /// Everything is held. `sigma`: standard deviation of a pixel coordinate [px].
    pub fn new<'a>(model: &Model, samples: impl Iterator<Item = &'a Seen>, sigma: f64, loss: Loss) -> Problem {
        let mut graph = Graph::new();
        let world = graph.held(Pose::identity());
        let base = graph.held(model.base);
        let parameters = graph.held(DynamicVector::from_column_slice(&model.parameters));
        let structure = graph.held(Pose::identity());
        let lens = |graph: &mut Graph, camera: &crate::rig::ModelCamera| {
            (graph.held(camera.pose), graph.held(Intrinsics::from(camera.intrinsics)))
        };
        let cameras: Vec<_> = model.cameras.iter().map(|camera| lens(&mut graph, camera)).collect();
        let features: Vec<_> = model.features.iter().map(|feature| graph.held(feature.xyz)).collect();
        let chain = Arc::new(model.chain.clone());
        let mut detections = 0;
        for sample in samples {
            let joints = graph.held(DynamicVector::from_column_slice(&sample.joints));
            let mut links = vec![None; chain.len() + 1];
            let mut attached = None;
            let mut carrier = |graph: &mut Graph, parent: Parent| {
                let upto = match parent {
                    Parent::World => return world,
                    Parent::Link(joint) => joint + 1,
                    Parent::Tip => chain.len(),
                };
                let kinematics = || ForwardKinematics { chain: chain.clone(), upto };
                *links[upto].get_or_insert_with(|| graph.derive(kinematics(), (base, parameters, joints)))
            };
            for spot in &sample.detections {
                let (feature, camera) = (&model.features[spot.feature], &model.cameras[spot.camera]);
                let mount = carrier(&mut graph, camera.parent);
                let mut on = carrier(&mut graph, feature.parent);
                if feature.parent == Parent::Tip {
                    on = *attached.get_or_insert_with(|| graph.derive(Attached, (on, structure)));
                }
                let (pose, intrinsics) = cameras[spot.camera];
                let factor = Reprojection { pixel: spot.pixel, model: camera.model };
                let nodes = (on, features[spot.feature], mount, pose, intrinsics);
                graph.factor(factor, nodes).sigma(sigma).loss(loss);
                detections += 1;
            }
        }
        Problem { graph, base, parameters, structure, cameras, features, detections }
    }

    /// Frees one part, and moves it to where it explains the samples best, in this many steps at most. The model, which is
    /// the one that the problem was made of, moves along. Returns the loss, Σ ρ(|r/σ|²).
    pub fn fit(&mut self, cause: &Cause, steps: usize, model: &mut Model) -> Result<f64, Error> {
        match *cause {
            Cause::Camera(camera) => self.graph.release(self.cameras[camera].0),
            Cause::Structure => self.graph.release(self.structure),
            Cause::Base => self.graph.release(self.base),
            Cause::Joint(joint) => {
                let zero = zero_of(model, joint);
                self.graph.release(self.parameters);
                let others: Vec<usize> = (0..model.parameters.len()).filter(|index| *index != zero).collect();
                self.graph.hold_coordinates(self.parameters, &others);
            }
            Cause::Unexplained => return Ok(2.0 * self.graph.cost()),
        }
        let minimiser = LevenbergMarquardt { max_iterations: steps, ..LevenbergMarquardt::default() };
        let report = minimiser.minimize(&mut self.graph)?;
        match *cause {
            Cause::Camera(camera) => model.cameras[camera].pose = self.graph.value(self.cameras[camera].0),
            Cause::Structure => {
                let moved = self.graph.value(self.structure);
                let on_tip = model.features.iter_mut().filter(|feature| feature.parent == Parent::Tip);
                on_tip.for_each(|feature| feature.xyz = moved.transform(&feature.xyz));
            }
            Cause::Base => model.base = self.graph.value(self.base),
            Cause::Joint(_) => model.parameters.copy_from_slice(self.graph.value(self.parameters).as_slice()),
            Cause::Unexplained => {}
        }
        Ok(2.0 * report.final_cost)
    }

    /// Norm of the gradient of the mean squared pixel distance [px²/(rad, m, px)] over all parameters of the rig: the base,
    /// the chain, cameras with focal lengths and principal points, features (table 7 of the paper).
    pub fn gradient_norm(mut self, rig: &Rig, sigma: f64) -> f64 {
        if self.detections == 0 {
            return 0.0;
        }
        self.graph.release(self.base);
        self.graph.release(self.parameters);
        // A joint has either β or, where it stands in for it, d.
        let stand_in = |(joint, row): (usize, &crate::rig::Joint)| {
            LINK_PARAMETERS * joint + if row.beta.is_some() { 1 } else { 4 }
        };
        let held: Vec<usize> = rig.robot.joints.iter().enumerate().map(stand_in).collect();
        self.graph.hold_coordinates(self.parameters, &held);
        for &(pose, intrinsics) in &self.cameras {
            self.graph.release(pose);
            self.graph.release(intrinsics);
            self.graph.hold_coordinates(intrinsics, &(4..12).collect::<Vec<_>>());
        }
        self.features.iter().for_each(|&feature| self.graph.release(feature));
        let mut workspace = Workspace::new(&self.graph);
        workspace.linearize_at(&self.graph);
        2.0 * sigma * sigma * workspace.normal_equations().1.norm() / self.detections as f64
    }
}

/// Width of the robust losses, in standard deviations.
const WIDTH: f64 = 3.0;

/// An explanation explains where the samples are then within this many times the usual median distance.
const EXPLAINED: f64 = 2.5;

/// Explanations whose scores differ by less are the same.
pub(super) const SAME: f64 = 1e-3;

/// Steps after which a part has been moved to where it explains samples best.
pub(super) const FIT_STEPS: usize = 30;

/// Moves each part alone to explain the samples: scores, best first, and the model that the best leads to. Where not even the
/// best explains them, [`Cause::Unexplained`] comes first and the model is as before.
pub(super) fn explain(model: &Model, samples: &[Seen], sigma: f64, usual_px: f64) -> (Vec<Score>, Model) {
    let n = samples.iter().map(|sample| 2 * sample.detections.len()).sum::<usize>() as f64;
    let mut found: Vec<(Score, Model)> = Vec::new();
    for cause in causes(model) {
        let mut moved = model.clone();
        // From wherever the change has put it, along the convex loss; then with wrong detections losing their pull.
        let mut loss = Ok(f64::INFINITY);
        for kind in [Loss::Huber(WIDTH), Loss::Cauchy(WIDTH)] {
            loss = Problem::new(&moved, samples.iter(), sigma, kind).fit(&cause, FIT_STEPS, &mut moved);
        }
        // A part that nothing of the samples depends on explains nothing.
        let Ok(loss) = loss else { continue };
        let bic = loss + cause.freedom() * n.ln();
        if bic.is_finite() {
            let median_px = median_px(&moved, samples);
            found.push((Score { cause, bic, median_px }, moved));
        }
    }
    // Of explanations that are the same motion, as of the only camera and of the base, the first.
    let least = found.iter().map(|(score, _)| score.bic).fold(f64::INFINITY, f64::min);
    let tied = |score: &Score| if score.bic < least + SAME { least } else { score.bic };
    found.sort_by(|(a, _), (b, _)| tied(a).total_cmp(&tied(b)));
    let explains = found.first().is_some_and(|(best, _)| best.median_px < EXPLAINED * usual_px);
    let best = found.first().filter(|_| explains).map_or_else(|| model.clone(), |(_, moved)| moved.clone());
    let mut scores: Vec<Score> = found.into_iter().map(|(score, _)| score).collect();
    if !explains {
        let loss = Problem::new(model, samples.iter(), sigma, Loss::Cauchy(WIDTH)).graph.cost();
        scores.insert(0, Score { cause: Cause::Unexplained, bic: 2.0 * loss, median_px: median_px(model, samples) });
    }
    (scores, best)
}

/// Pixel distances of a sample per camera of the model.
pub(super) fn distances(model: &Model, sample: &Seen) -> Vec<Vec<f64>> {
    let links = model.links(&sample.joints);
    let mut images = vec![Vec::new(); model.cameras.len()];
    for spot in &sample.detections {
        let [u, v] = model.pixel(spot.camera, spot.feature, &links);
        let distance = (u - spot.pixel[0]).hypot(v - spot.pixel[1]);
        images[spot.camera].push(if distance.is_finite() { distance } else { f64::MAX });
    }
    images
}

/// The images of a sample, under readings whose standard deviation is `noise` [rad or m].
pub(super) fn images(model: &Model, sample: &Seen, noise: f64) -> Vec<Image> {
    let distances = distances(model, sample);
    let mut squares = vec![0.0; model.cameras.len()];
    let here = model.links(&sample.joints);
    for there in displaced_by_joint(model, &sample.joints, noise) {
        for spot in &sample.detections {
            let [from, to] = [&here, &there].map(|links| model.pixel(spot.camera, spot.feature, links));
            squares[spot.camera] += (to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2);
        }
    }
    let image = |(distances, square): (Vec<f64>, f64)| {
        // Two coordinates each.
        let shift = (square / (2 * distances.len()).max(1) as f64).sqrt();
        Image { distances, shift: if shift.is_finite() { shift } else { 0.0 } }
    };
    distances.into_iter().zip(squares).map(image).collect()
}

fn median_px(model: &Model, samples: &[Seen]) -> f64 {
    let mut all: Vec<f64> = samples.iter().flat_map(|sample| distances(model, sample).concat()).collect();
    crate::calibrate::median(&mut all)
}

/// Index of the chain's parameter that shifts the reading of a joint.
pub(super) fn zero_of(model: &Model, joint: usize) -> usize {
    LINK_PARAMETERS * joint + usize::from(model.chain.kinds[joint] == JointKind::Prismatic)
}
