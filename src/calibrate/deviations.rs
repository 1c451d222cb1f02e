//! How well the learned numbers are determined: standard deviations, the tip's in metres, and what only a prior decides.
use super::graph::{Built, Freedom, Priors, build, row};
use super::observation::Kind;
use super::outliers::Verdict;
use super::residuals::whitened;
use super::setup::Setup;
use super::sources::{self, Sources};
use super::stage::{Stage, Stages};
use super::weak::Combination;
use super::{PoseDeviation, TipDeviation, gauge, lengths, poorly, variances};
use crate::calibrate::graph::State;
use crate::factors::ForwardKinematics;
use crate::rig::{CameraField, JointField, Parameter};
use handeye_solvers::{Covariance, DynamicVector, Key, Loss, Pose, Solver, WeakDirection};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Standard deviations of what was learned.
#[derive(Clone, Debug, Default)]
pub(crate) struct Deviations {
    /// By parameter path, as in the rig file's `[fit.sd]`.
    pub by_path: BTreeMap<String, Vec<f64>>,
    /// Over the recorded samples; `None` where the data leave something open.
    pub tip: Option<TipDeviation>,
    /// Of every camera's pose against the arm; empty where the tip's is not known.
    pub cameras: Vec<PoseDeviation>,
    /// What nothing, or a prior more than the data, determines.
    pub weak: Vec<Combination>,
}

/// Coordinates of a pose's step.
const ROTATION: Range<usize> = 0..3;
const POSITION: Range<usize> = 3..6;

/// Samples whose tip is looked at, spread evenly over the recording.
const TIPS: usize = 200;

/// The final problem with the noise that the residuals show, in place of the stated one.
///
/// With weights w = 1/(1 + s/k²) of Cauchy's loss at the squared whitened distance s of m coordinates, an M-estimator's
/// covariance is that of least squares times E[w² s / m] / E[ψ']² (Huber 1981, eq. 6.6), with ψ' = w² (1 + (1 - 2/m) s/k²) the
/// mean of ∂ψ/∂r over directions. Data alone are rescaled, pixels and points each by their own: priors say what they say. Less
/// noise than stated is not believed.
pub(crate) struct Honest<'a> {
    pub setup: Setup,
    pub priors: &'a Priors,
    pub loss: Loss,
}

impl<'a> Honest<'a> {
    pub fn new(stages: &Stages<'a>, last: &Stage<'_>, state: &State, verdict: &Verdict) -> Self {
        let width = if let Loss::Cauchy(width) = last.loss { width } else { f64::INFINITY };
        let distances = whitened(stages.setup, state);
        // Where something is open, nothing is said of deviations.
        let redundancies = variances::redundancies(stages, last, state, verdict).ok();
        let shown = |kind: Kind| {
            let m = kind.coordinates();
            let (mut pulls, mut slopes, mut n) = (0.0, 0.0, 0.0);
            for distance in in_use(stages.setup, &distances, verdict, kind) {
                let s = distance * distance;
                let ratio = s / (width * width);
                let w = 1.0 / (1.0 + ratio);
                (pulls, slopes, n) = (pulls + w * w * s, slopes + w * w * (1.0 + (1.0 - 2.0 / m) * ratio), n + 1.0);
            }
            let redundancy = redundancies.map_or(m * n, |redundancies| redundancies[kind as usize]);
            let left = if redundancy >= 1.0 { m * n / redundancy } else { 1.0 };
            let ratio = if n > 0.0 { left * pulls / m * n / (slopes * slopes) } else { 1.0 };
            stages.setup.sd(kind) * ratio.max(1.0).sqrt()
        };
        let mut setup = stages.setup.clone();
        (setup.rig.noise.pixels, setup.rig.noise.points) = (shown(Kind::Pixels), shown(Kind::Points));
        lengths::leave_out_missed(&mut setup, state);
        Honest { setup, priors: stages.priors, loss: Loss::Squared }
    }

    pub fn build(&self, freedom: &Freedom, state: &State, verdict: &Verdict) -> Built {
        build(&self.setup, state, freedom, self.priors, self.loss, |index| verdict.active[index])
    }
}

/// Root of the mean square of a coordinate's error over the stated noise.
pub(crate) fn scatter(setup: &Setup, state: &State, verdict: &Verdict) -> f64 {
    let distances = whitened(setup, state);
    let (mut squares, mut coordinates) = (0.0, 0.0);
    for kind in Kind::ALL {
        for distance in in_use(setup, &distances, verdict, kind) {
            squares += distance * distance;
            coordinates += kind.coordinates();
        }
    }
    (squares / f64::max(coordinates, 2.0)).sqrt()
}

/// Those of the distances that are of a kind and take part.
fn in_use<'a>(
    setup: &'a Setup,
    distances: &'a [f64],
    verdict: &'a Verdict,
    kind: Kind,
) -> impl Iterator<Item = f64> + 'a {
    let all = setup.observations.iter().zip(distances).zip(&verdict.active);
    all.filter(move |((seen, _), active)| **active && seen.kind() == kind).map(|((_, distance), _)| *distance)
}

/// Deviations at the final state of a stage, by the linearised problem.
pub(crate) fn deviations(honest: &Honest<'_>, freedom: &Freedom, state: &State, verdict: &Verdict) -> Deviations {
    let mut deviations = Deviations::default();
    let built = honest.build(freedom, state, verdict);
    let mut solver = Solver::new(&built.graph);
    if let Ok(found) = WeakDirection::find(&built.graph, &mut solver, Some(&built.states())) {
        deviations.weak = Combination::all(honest, state, &built, &found);
    }
    if let Ok(mut covariance) = Covariance::with(&built.graph, solver) {
        deviations.by_path = by_path(&honest.setup, freedom, &built, &mut covariance);
        if deviations.weak.is_empty() {
            deviations.weak.extend(poorly::determined(honest, state, freedom, &built, &mut covariance));
        }
        if let Some((tip, cameras)) = against_arm(honest, freedom, state, verdict) {
            (deviations.tip, deviations.cameras) = (Some(tip), cameras);
        }
    }
    deviations
}

/// Deviation of the tip's position, root of the trace of its covariance, over the samples; and of every camera's pose.
///
/// The base and the tip's frame are taken as they are: where only a prior says how the base lies against the first axis, or
/// the tip's frame against the features, nothing that is seen depends on it. Joints are taken as they are too: how well those
/// of a sample were read is no matter of the rig. `None` also where the tip does not follow from anything that is learned.
fn against_arm(
    honest: &Honest<'_>,
    freedom: &Freedom,
    state: &State,
    verdict: &Verdict,
) -> Option<(TipDeviation, Vec<PoseDeviation>)> {
    let freedom = gauge::with_frames_held(&honest.setup, freedom);
    if !gauge::is_tip_learned(&honest.setup, &freedom) {
        return None;
    }
    let mut built = honest.build(&freedom, state, verdict);
    let tips = tips_at_held_joints(&mut built, state);
    let mut covariance = Covariance::new(&built.graph).ok()?;
    let mut of_samples: Vec<Sources> = Vec::new();
    for tip in tips {
        let [position, _] = sources::of_pose(&built, &mut covariance, tip, [POSITION, ROTATION]);
        of_samples.push(position);
    }
    of_samples.sort_by(|one, other| one.whole().total_cmp(&other.whole()));
    let sources = *of_samples.get(of_samples.len() / 2)?;
    let largest = of_samples.last()?.whole();
    let metric = gauge::length_is_known(&honest.setup);
    let tip = TipDeviation { median: sources.whole(), largest, by_data: sources.data, sources, metric };
    let pose = |(key, _): &(Key<Pose>, _)| {
        let [sources, angle] = sources::of_pose(&built, &mut covariance, *key, [POSITION, ROTATION]);
        PoseDeviation { length: sources.whole(), angle: angle.whole(), sources }
    };
    let cameras = built.cameras.iter().map(pose).collect();
    Some((tip, cameras))
}

/// Derived tips of samples, spread evenly over the recording.
fn tips_at_held_joints(built: &mut Built, state: &State) -> Vec<Key<Pose>> {
    let in_use = |&sample: &usize| state.placed[sample] && built.joints[sample].is_some();
    let samples: Vec<usize> = (0..state.joints.len()).filter(in_use).collect();
    let every = samples.len().div_ceil(TIPS).max(1);
    let chain = Arc::new(state.model.chain.clone());
    let tips = samples.into_iter().step_by(every).map(|sample| {
        let joints = built.graph.held(DynamicVector::from_column_slice(&state.joints[sample]));
        let tip = ForwardKinematics { chain: chain.clone(), upto: chain.len() };
        built.graph.derive(tip, (built.base, built.parameters, joints))
    });
    tips.collect()
}

/// Standard deviations of everything that is free; poses as translation, then rotation vector.
fn by_path(
    setup: &Setup,
    freedom: &Freedom,
    built: &Built,
    covariance: &mut Covariance<'_>,
) -> BTreeMap<String, Vec<f64>> {
    let mut by_path = BTreeMap::new();
    let diagonal = |block: nalgebra::DMatrix<f64>| -> Vec<f64> {
        block.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect()
    };
    let base = diagonal(covariance.of(built.base));
    let parameters = diagonal(covariance.of(built.parameters));
    let cameras: Vec<_> = built
        .cameras
        .iter()
        .map(|&(pose, intrinsics)| (diagonal(covariance.of(pose)), diagonal(covariance.of(intrinsics))))
        .collect();
    let features: Vec<_> = built.features.iter().map(|&feature| diagonal(covariance.of(feature))).collect();
    let pose = |sd: &[f64]| [&sd[3..], &sd[..3]].concat();
    let mut rig = setup.rig.clone();
    // Every joint may have learned a beta.
    rig.robot.joints.iter_mut().for_each(|joint| joint.beta = joint.beta.or(Some(0.0)));
    for parameter in rig.parameters() {
        let (held, sd): (&[bool], Vec<f64>) = match parameter {
            Parameter::Base => (&freedom.base, pose(&base)),
            Parameter::JointField { joint, field } => {
                let at = row(joint) + coordinate_of(field);
                (&freedom.parameters[at..at + 1], vec![parameters[at]])
            }
            Parameter::CameraPose(camera) => (&freedom.cameras[camera], pose(&cameras[camera].0)),
            Parameter::CameraField { camera, field } => {
                let range = intrinsics_of(field, rig.cameras[camera].distortion.as_ref().map_or(0, Vec::len));
                (&freedom.intrinsics[camera][range.clone()], cameras[camera].1[range].to_vec())
            }
            Parameter::FeatureXyz(feature) => (&freedom.features[feature], features[feature].clone()),
            Parameter::TargetPose(_) => continue,
        };
        if held.iter().any(|held| !held) {
            by_path.insert(parameter.path(&rig), sd);
        }
    }
    by_path
}

/// Place of a field among a joint's five numbers.
pub(crate) fn coordinate_of(field: JointField) -> usize {
    match field {
        JointField::Offset => 0,
        JointField::D => 1,
        JointField::A => 2,
        JointField::Alpha => 3,
        JointField::Beta => 4,
    }
}

/// Places of a field among a camera's twelve numbers.
pub(crate) fn intrinsics_of(field: CameraField, distortion: usize) -> std::ops::Range<usize> {
    match field {
        CameraField::Fx => 0..1,
        CameraField::Fy => 1..2,
        CameraField::Cx => 2..3,
        CameraField::Cy => 3..4,
        CameraField::Distortion => 4..4 + distortion,
    }
}

/// A coordinate of a node by its parameter path.
pub(crate) fn name(setup: &Setup, built: &Built, node: usize, coordinate: usize) -> String {
    let rig = &setup.rig;
    let step = ["rotation x", "rotation y", "rotation z", "x", "y", "z"];
    if node == built.base.index() {
        return format!("robot.base ({})", step[coordinate]);
    }
    if node == built.parameters.index() {
        let joint = coordinate / row(1);
        let field = ["offset", "d", "a", "alpha", "beta"][coordinate % row(1)];
        return format!("robot.joints.{}.{field}", rig.robot.joints[joint].name);
    }
    for (camera, (pose, intrinsics)) in rig.cameras.iter().zip(&built.cameras) {
        if node == pose.index() {
            return format!("cameras.{}.pose ({})", camera.name, step[coordinate]);
        }
        if node == intrinsics.index() {
            let field = ["fx", "fy", "cx", "cy"].get(coordinate).copied().unwrap_or("distortion");
            return format!("cameras.{}.{field}", camera.name);
        }
    }
    let feature = rig.features.iter().zip(&built.features).find(|(_, key)| key.index() == node);
    feature.map_or_else(|| format!("node {node}"), |(feature, _)| format!("features.{}.xyz", feature.name))
}
