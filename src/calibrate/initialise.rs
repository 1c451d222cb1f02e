//! From a recording to a first state of everything, without starting values (stages 1 to 3).
use super::anchor::Anchor;
use super::graph::{Freedom, State};
use super::kinematics::{find_axes, find_lines, rows};
use super::settle::settle;
use super::setup::Setup;
use super::stage::{Stage, Stages};
use super::visual::{Scene, Sighting, Views, reconstruct};
use super::{gauge, join};
use crate::Error;
use crate::rig::Parent;
use handeye_solvers::{Loss, Pose};

/// What the images showed, refined: tips of the samples that could be placed.
struct Seen {
    state: State,
    placed: Vec<bool>,
    cameras: Vec<bool>,
    features: Vec<bool>,
}

/// Samples of a long recording that are looked at, at most; the others come in with the chain.
const LOOK: usize = 400;

/// A bearing may be off by this many standard deviations, or by this many pixels where intrinsics are not yet right.
const THRESHOLD: f64 = 4.0;
const THRESHOLD_PX: f64 = 2.0;

/// Widths of Cauchy's loss while only cameras, structure and tips are fitted [standard deviations].
const WIDTHS: [f64; 2] = [20.0, 3.0];

/// Finds a first state.
pub(crate) fn initialise(seed: u64, stages: &mut Stages<'_>) -> Result<State, Error> {
    let setup = stages.setup;
    let seen = look(seed, stages)?;
    let mut state = seen.state;
    let samples: Vec<usize> = (0..setup.joints.len()).filter(|&sample| seen.placed[sample]).collect();
    let tips: Vec<Pose> = samples.iter().map(|&sample| state.tips[sample]).collect();
    if setup.chain_is_known() {
        let model = &setup.model;
        let chain: Vec<Pose> = samples.iter().map(|&sample| model.tip(&setup.joints[sample])).collect();
        let anchor = Anchor::find(&tips, &chain, seed).ok_or_else(|| {
            Error::NotEnoughData(format!(
                "the {} samples whose tip could be placed turn it about one axis only, or not at all: add samples that \
                 turn it about two axes",
                samples.len()
            ))
        })?;
        anchor.apply(&mut state);
    } else {
        learn_chain(&samples, &mut state, seed, stages)?;
    }
    join::join(setup, &mut state, &seen.cameras, &seen.features, seed)?;
    settle(setup, &mut state);
    Ok(state)
}

/// Cameras, structure and tips from the images alone (eqs. 2 and 3).
fn look(seed: u64, stages: &mut Stages<'_>) -> Result<Seen, Error> {
    let setup = stages.setup;
    let on_arm = cameras_are_on_the_arm(setup);
    let (mount, object) = if on_arm { (Parent::Tip, Parent::World) } else { (Parent::World, Parent::Tip) };
    let model = &setup.model;
    let mut samples: Vec<Vec<Sighting>> = vec![Vec::new(); setup.joints.len()];
    let every = setup.joints.len().div_ceil(LOOK);
    for seen in setup.observations.iter().filter(|seen| seen.sample % every == 0) {
        let camera = &model.cameras[seen.camera];
        if camera.parent != mount || model.features[seen.feature].parent != object {
            continue;
        }
        if let Some(bearing) = camera.model.unproject(&camera.intrinsics, seen.pixel) {
            samples[seen.sample].push(Sighting { camera: seen.camera, feature: seen.feature, bearing });
        }
    }
    let focal = model.cameras.iter().map(|camera| camera.intrinsics[0]).fold(f64::INFINITY, f64::min);
    let threshold = (THRESHOLD * setup.sigma()).max(THRESHOLD_PX) / focal;
    let views =
        Views { samples: &samples, cameras: model.cameras.len(), features: model.features.len(), threshold, seed };
    let scenes = reconstruct(&views);
    let mut best: Option<(f64, Seen)> = None;
    for scene in scenes {
        let Some(mut seen) = seen_from(setup, &scene, on_arm) else { continue };
        let mut freedom = Freedom::all(setup, false);
        // Images alone tell little of intrinsics: those that are given are trusted until the chain is there.
        for (held, known) in freedom.intrinsics.iter_mut().zip(&setup.intrinsics) {
            *held = std::array::from_fn(|i| held[i] || i >= 2 || known.focal);
        }
        freedom.cameras[seen.cameras.iter().position(|placed| *placed).unwrap_or(0)] = [true; 6];
        let reference = seen.placed.iter().position(|placed| *placed).unwrap_or(0);
        freedom.tips[reference] = true;
        let takes_part = |index: usize| {
            let o = &setup.observations[index];
            let parents = (model.cameras[o.camera].parent, model.features[o.feature].parent);
            parents == (mount, object) && seen.placed[o.sample] && seen.cameras[o.camera] && seen.features[o.feature]
        };
        let count = (0..setup.observations.len()).filter(|&index| takes_part(index)).count();
        // Missing observations are as bad as outliers.
        let mut cost = 20.0 * (setup.observations.len() - count) as f64;
        for width in WIDTHS {
            let loss = Loss::Cauchy(width);
            let stage = Stage { name: "cameras and structure", freedom: &freedom, loss, takes_part: &takes_part };
            let report = stages.minimize(&stage, &mut seen.state)?;
            cost += if width == WIDTHS[1] { report.final_cost } else { 0.0 };
        }
        if best.as_ref().is_none_or(|best| cost < best.0) {
            best = Some((cost, seen));
        }
    }
    best.map(|(_, seen)| seen).ok_or_else(|| join::what_is_missing(setup))
}

/// True where most detections are of features in the world, by cameras on the tip.
fn cameras_are_on_the_arm(setup: &Setup) -> bool {
    let model = &setup.model;
    let pairs = setup.observations.iter().map(|o| (model.cameras[o.camera].parent, model.features[o.feature].parent));
    let (mut on_arm, mut in_world) = (0, 0);
    for pair in pairs {
        on_arm += usize::from(pair == (Parent::Tip, Parent::World));
        in_world += usize::from(pair == (Parent::World, Parent::Tip));
    }
    on_arm > in_world
}

fn seen_from(setup: &Setup, scene: &Scene, on_arm: bool) -> Option<Seen> {
    let mut state = State { model: setup.model.clone(), tips: vec![Pose::identity(); setup.joints.len()] };
    for (camera, pose) in state.model.cameras.iter_mut().zip(&scene.cameras) {
        camera.pose = pose.unwrap_or(camera.pose);
    }
    for (feature, xyz) in state.model.features.iter_mut().zip(&scene.features) {
        feature.xyz = xyz.unwrap_or(feature.xyz);
    }
    for (tip, object) in state.tips.iter_mut().zip(&scene.objects) {
        if let Some(mount_from_object) = object {
            *tip = if on_arm { mount_from_object.inverse() } else { *mount_from_object };
        }
    }
    let placed: Vec<bool> = scene.objects.iter().map(Option::is_some).collect();
    (placed.iter().filter(|placed| **placed).count() >= 3).then(|| Seen {
        state,
        placed,
        cameras: scene.cameras.iter().map(Option::is_some).collect(),
        features: scene.features.iter().map(Option::is_some).collect(),
    })
}

/// The chain from the seen tips (eq. 5), and everything that was seen moved to where it is.
fn learn_chain(samples: &[usize], state: &mut State, seed: u64, stages: &mut Stages<'_>) -> Result<(), Error> {
    let setup = stages.setup;
    let kinds = &setup.model.chain.kinds;
    let needed = kinds.len() + 2;
    if samples.len() < needed {
        return Err(Error::NotEnoughData(format!(
            "the tip could be placed in {} samples, and a chain of {} joints needs at least {needed}",
            samples.len(),
            kinds.len()
        )));
    }
    let signed: Vec<Vec<f64>> = samples
        .iter()
        .map(|&sample| {
            let reversed = &setup.model.chain.reversed;
            setup.joints[sample].iter().zip(reversed).map(|(j, reversed)| if *reversed { -j } else { *j }).collect()
        })
        .collect();
    let joints: Vec<&[f64]> = signed.iter().map(Vec::as_slice).collect();
    let mut tips: Vec<Pose> = samples.iter().map(|&sample| state.tips[sample]).collect();
    let rotations: Vec<_> = tips.iter().map(|tip| tip.rotation).collect();
    let started = std::time::Instant::now();
    let undetermined =
        || Error::NotEnoughData("the joints' readings and the seen motion of the tip do not fit together".into());
    let axes = find_axes(kinds, &joints, &rotations, 0.02, seed).ok_or_else(undetermined)?;
    let mut lines = find_lines(kinds, &axes, &joints, &tips).ok_or_else(undetermined)?;
    if let Some(unit) = lines.unit {
        gauge::rescale(state, 1.0 / unit);
        tips = samples.iter().map(|&sample| state.tips[sample]).collect();
        lines = find_lines(kinds, &axes, &joints, &tips).ok_or_else(undetermined)?;
    }
    let (base, parameters) = rows(setup.model.chain.convention, kinds, &lines);
    state.model.base = base;
    state.model.parameters = parameters;
    // The tip's frame is now the chain's: what was fixed to the seen tip moves over.
    let at_zero = state.model.tip(&vec![0.0; kinds.len()]);
    let tip = at_zero.inverse() * lines.at_zero;
    Anchor { scale: 1.0, world: Pose::identity(), tip }.apply(state);
    let angles = |angles: &[f64]| 0.5 * angles.iter().map(|angle| angle * angle).sum::<f64>();
    stages.record("kinematics", axes.iterations, (angles(&axes.first_angles), angles(&axes.angles)), started);
    Ok(())
}
