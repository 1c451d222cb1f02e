//! The learned rig and its account, from the final state.
use super::deviations::Deviations;
use super::evaluate::{Distances, Errors, PixelDistance};
use super::gauge;
use super::graph::{State, row};
use super::lengths;
use super::misfit::misfits;
use super::observation::Kind;
use super::outliers::Verdict;
use super::priors::prior_sds;
use super::residuals::distances;
use super::setup::Setup;
use super::weak;
use super::{Calibration, CameraErrors, Finding, ReadingNoise, Report, StageReport};
use crate::camera::CameraModel;
use crate::rig::{Fit, JointField, Parameter, Rig};
use handeye_solvers::Pose;

/// Values are told of where they are so many standard deviations from what was given.
const FAR: f64 = 5.0;

/// Puts everything together.
pub(crate) fn finish(
    setup: &Setup,
    state: &State,
    verdict: Verdict,
    stages: Vec<StageReport>,
    converged: bool,
    mut gauge: Vec<String>,
    deviations: Deviations,
) -> Calibration {
    let distances = distances(setup, state);
    let links: Vec<Vec<Pose>> = state.all_links(setup);
    let mut of_camera = vec![Distances::default(); setup.rig.cameras.len()];
    let mut left_out = vec![0; setup.rig.cameras.len()];
    let mut used_samples = vec![false; setup.len()];
    for ((seen, distance), active) in setup.observations.iter().zip(&distances).zip(&verdict.active) {
        if !*active {
            left_out[seen.camera] += 1;
            continue;
        }
        used_samples[seen.sample] = true;
        let of_camera = &mut of_camera[seen.camera];
        match seen.kind() {
            Kind::Pixels => {
                let point = state.model.in_camera(seen.camera, seen.feature, &links[seen.sample]);
                of_camera.pixels.push(PixelDistance::new(*distance, &state.model.cameras[seen.camera], &point));
            }
            Kind::Points => of_camera.points.push(*distance),
        }
    }
    let mut together = Distances::default();
    of_camera.iter().for_each(|distances| together.extend(distances));
    let total = Errors::new(&together);
    let cameras = setup
        .rig
        .cameras
        .iter()
        .zip(of_camera.iter().zip(&left_out))
        .map(|(camera, (distances, &rejected))| CameraErrors {
            name: camera.name.clone(),
            errors: Errors::new(distances),
            rejected,
        })
        .collect();
    let samples = used_samples.iter().filter(|used| **used).count();
    let rejected = left_out.iter().sum();
    gauge.extend(weak::in_words(&deviations.weak));
    let mut rig = learned(setup, state);
    rig.fit = Some(Fit {
        samples,
        observations: total.observations,
        rejected,
        rms_px: total.rms_px,
        mean_px: total.mean_px,
        rms_points_m: (total.points.observations > 0).then_some(total.points.rms_m),
        gauge: gauge.clone(),
        joints: ranges(setup, state, &used_samples),
        sd: deviations.by_path,
    });
    let far = far_from_given(&setup.rig, &rig);
    let unseen = setup.unseen.iter().map(|camera| Finding::UnseenCamera { camera: camera.clone() });
    let misfits = misfits(&setup.rig.noise, &total, &ReadingNoise::default());
    let report = Report {
        samples,
        observations: total.observations,
        rejected,
        rms_px: total.rms_px,
        mean_px: total.mean_px,
        median_px: total.median_px,
        points: total.points,
        cameras,
        stages,
        converged,
        metric: gauge::length_is_known(setup),
        gauge,
        noise: None,
        states: setup.states.words(&setup.rig.noise),
        findings: misfits
            .into_iter()
            .chain(lengths::missed(setup, state))
            .chain(far)
            .chain(unseen)
            .chain(verdict.findings)
            .collect(),
        tip: deviations.tip,
        camera_poses: deviations.cameras,
        weak: deviations.weak,
        influence: Vec::new(),
        targets: None,
    };
    Calibration { rig, report }
}

/// Joints' numbers that were given, are not held, and are somewhere else.
fn far_from_given(given: &Rig, learned: &Rig) -> Option<Finding> {
    let mut values: Vec<(String, [f64; 2], f64)> = Vec::new();
    for parameter in given.parameters().into_iter().filter(|parameter| !given.is_fixed(parameter)) {
        let Parameter::JointField { joint, field } = parameter else { continue };
        let both = [given, learned].map(|rig| field.value(&rig.robot.joints[joint]));
        let ([Some(was), Some(is)], Some(sds)) = (both, prior_sds(given, &parameter)) else { continue };
        let is_length = matches!(field, JointField::D | JointField::A);
        let off = if is_length { is - was } else { wrapped(is - was) };
        let sds = off.abs() / sds[0];
        if sds > FAR {
            values.push((parameter.path(given), [was, is], sds));
        }
    }
    values.sort_by(|one, other| other.2.total_cmp(&one.2));
    (!values.is_empty()).then_some(Finding::FarFromGiven { values })
}

/// Smallest and largest value of every joint in samples with joints that were used.
fn ranges(setup: &Setup, state: &State, used: &[bool]) -> Vec<[f64; 2]> {
    let is_used = |sample: &usize| setup.states.chain && state.placed[*sample] && used[*sample];
    let widened = |ranges: Option<Vec<[f64; 2]>>, sample: usize| {
        let joints = &state.joints[sample];
        let widen = |([lower, upper], joint): ([f64; 2], &f64)| [lower.min(*joint), upper.max(*joint)];
        let all = ranges.unwrap_or_else(|| joints.iter().map(|joint| [*joint; 2]).collect());
        Some(all.into_iter().zip(joints).map(widen).collect())
    };
    (0..setup.len()).filter(is_used).fold(None, widened).unwrap_or_default()
}

/// The rig with every value filled in.
fn learned(setup: &Setup, state: &State) -> Rig {
    let mut rig = setup.rig.clone();
    let model = &state.model;
    if setup.states.chain {
        rig.robot.base = Some(model.base);
    }
    for (index, joint) in rig.robot.joints.iter_mut().enumerate() {
        let [offset, d, a, alpha, beta] = std::array::from_fn(|k| model.parameters[row(index) + k]);
        joint.offset = Some(wrapped(offset));
        joint.d = Some(d);
        joint.a = Some(a);
        joint.alpha = Some(wrapped(alpha));
        joint.beta = (joint.beta.is_some() || beta != 0.0).then_some(beta);
    }
    for (camera, learned) in rig.cameras.iter_mut().zip(&model.cameras) {
        let [fx, fy, cx, cy, ..] = learned.intrinsics;
        camera.pose = Some(learned.pose);
        if !learned.has_lens() {
            continue;
        }
        camera.model = Some(learned.model);
        (camera.fx, camera.fy, camera.cx, camera.cy) = (Some(fx), Some(fy), Some(cx), Some(cy));
        let coefficients = learned.model.distortion().len();
        camera.distortion =
            (learned.model != CameraModel::Pinhole).then(|| learned.intrinsics[4..4 + coefficients].to_vec());
    }
    for (feature, learned) in rig.features.iter_mut().zip(&model.features) {
        feature.xyz = Some(learned.xyz.into());
    }
    rig
}

/// The same angle in (-π, π], left alone where it is there already.
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    if angle.abs() <= 0.5 * turn { angle } else { angle - turn * (angle / turn).round() }
}
