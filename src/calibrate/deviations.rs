//! How well the learned numbers are determined: standard deviations, the tip's in metres, and what only a prior decides.
use super::evaluate::median;
use super::graph::{Built, Freedom, row};
use super::outliers::{Verdict, distances};
use super::setup::Setup;
use super::stage::{Stage, Stages};
use super::{TipDeviation, gauge};
use crate::calibrate::graph::State;
use crate::rig::{CameraField, JointField, Parameter};
use handeye_solvers::{Covariance, Solver, WeakDirection, Weakness};
use std::collections::BTreeMap;

/// Standard deviations of what was learned.
#[derive(Clone, Debug, Default)]
pub(crate) struct Deviations {
    /// By parameter path, as in the rig file's `[fit.sd]`.
    pub by_path: BTreeMap<String, Vec<f64>>,
    /// Over the recorded samples; `None` where the data leave something open.
    pub tip: Option<TipDeviation>,
    /// Directions that nothing, or only a prior, determines, in words.
    pub weak: Vec<String>,
}

/// Samples whose tip is looked at, spread evenly over the recording.
const TIPS: usize = 200;

/// Weak directions that are put in words, and how many numbers each names.
const DIRECTIONS: usize = 6;
const NAMED: usize = 4;

/// Deviations at the final state of a stage, by the linearised problem. Where the residuals are larger than the stated noise
/// explains, all deviations are larger by that factor.
pub(crate) fn deviations(stages: &Stages<'_>, last: &Stage<'_>, state: &State, verdict: &Verdict) -> Deviations {
    let setup = stages.setup;
    let mut deviations = Deviations::default();
    let built = stages.build(last, state);
    let mut solver = Solver::new(&built.graph);
    if let Ok(found) = WeakDirection::find(&built.graph, &mut solver, None) {
        deviations.weak = found.iter().take(DIRECTIONS).map(|weak| words(setup, &built, weak)).collect();
        if found.len() > DIRECTIONS {
            deviations.weak.push(format!("and {} combinations more like these", found.len() - DIRECTIONS));
        }
    }
    let factor = scatter(setup, state, verdict).max(1.0);
    if let Ok(mut covariance) = Covariance::with(&built.graph, solver) {
        deviations.by_path = by_path(setup, last.freedom, &built, &mut covariance, factor);
        deviations.tip = tip(stages, last, state, factor);
    }
    deviations
}

/// Deviation of the tip's position, root of the trace of its covariance, over the samples.
///
/// The base and the tip's frame are taken as they are: where only a prior says how the base lies against the first axis, or
/// the tip's frame against the features, nothing that is seen depends on it.
fn tip(stages: &Stages<'_>, last: &Stage<'_>, state: &State, factor: f64) -> Option<TipDeviation> {
    let freedom = gauge::with_frames_held(stages.setup, last.freedom);
    let built = stages.build(&Stage { freedom: &freedom, ..*last }, state);
    let mut covariance = Covariance::new(&built.graph).ok()?;
    let tips: Vec<_> = built.tips.iter().flatten().copied().collect();
    let every = tips.len().div_ceil(TIPS).max(1);
    let deviation = |tip| {
        let block = covariance.of(tip);
        factor * (block[(3, 3)] + block[(4, 4)] + block[(5, 5)]).max(0.0).sqrt()
    };
    let mut sds: Vec<f64> = tips.into_iter().step_by(every).map(deviation).collect();
    let largest = sds.iter().copied().reduce(f64::max)?;
    Some(TipDeviation { median: median(&mut sds), largest, metric: gauge::length_is_known(stages.setup) })
}

/// Root of the mean square of a coordinate's error over the stated noise.
fn scatter(setup: &Setup, state: &State, verdict: &Verdict) -> f64 {
    let distances = distances(setup, state);
    let used: Vec<f64> = distances.iter().zip(&verdict.active).filter(|(_, used)| **used).map(|(d, _)| d * d).collect();
    (used.iter().sum::<f64>() / (2.0 * used.len().max(1) as f64)).sqrt() / setup.sigma()
}

/// Standard deviations of everything that is free; poses as translation, then rotation vector.
fn by_path(
    setup: &Setup,
    freedom: &Freedom,
    built: &Built,
    covariance: &mut Covariance<'_>,
    factor: f64,
) -> BTreeMap<String, Vec<f64>> {
    let mut by_path = BTreeMap::new();
    let diagonal = |block: nalgebra::DMatrix<f64>| -> Vec<f64> {
        block.diagonal().iter().map(|variance| factor * variance.max(0.0).sqrt()).collect()
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

/// A weak direction in words.
fn words(setup: &Setup, built: &Built, weak: &WeakDirection) -> String {
    let names: Vec<String> =
        weak.components.iter().take(NAMED).map(|part| name(setup, built, part.node, part.coordinate)).collect();
    let others = weak.components.len().saturating_sub(NAMED);
    let others = if others > 0 { format!(" and {others} more") } else { String::new() };
    let what = match weak.kind {
        Weakness::Open => "nothing determines".to_owned(),
        Weakness::Prior if weak.sd_ratio > 1e3 => "only a prior determines".to_owned(),
        Weakness::Prior => format!("a prior more than the data ({:.1} to 1) determines", weak.sd_ratio),
    };
    let kind = if weak.components.len() == 1 { "" } else { "a combination of " };
    format!("{what} {kind}{}{others}", names.join(", "))
}

/// A coordinate of a node by its parameter path.
fn name(setup: &Setup, built: &Built, node: usize, coordinate: usize) -> String {
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
