//! Cameras, structure and tips from the images alone (eqs. 2 and 3).
use super::evaluate::median;
use super::gauge;
use super::graph::{Freedom, State};
use super::join;
use super::observation::{Kind, Observation};
use super::setup::Setup;
use super::stage::{Stage, Stages};
use super::visual::{Scene, Sighting, Views, reconstruct};
use crate::Error;
use crate::rig::Parent;
use handeye_solvers::{Loss, Pose};

/// What the images showed, refined, and what of it could be placed.
pub(crate) struct Seen {
    pub state: State,
    /// Samples whose tips are placed.
    pub placed: Vec<bool>,
    pub cameras: Vec<bool>,
    pub features: Vec<bool>,
    cost: f64,
}

impl Seen {
    /// The samples whose tips are placed.
    pub fn samples(&self) -> Vec<usize> {
        (0..self.placed.len()).filter(|&sample| self.placed[sample]).collect()
    }
}

/// Samples of a long recording that are looked at, at most; the others come in with the chain.
const LOOK: usize = 400;

/// A bearing may be off by this many standard deviations, or by this many pixels where intrinsics are not yet right.
const THRESHOLD: f64 = 4.0;
const THRESHOLD_PX: f64 = 2.0;

/// Widths of Cauchy's loss: for all that might be seen, and for what is left of it [standard deviations].
const WIDTHS: [f64; 2] = [20.0, 3.0];

/// Explanations of the images that are kept, and the share of cost below which two of them are the same.
const KEPT: usize = 6;
const SAME: f64 = 1e-6;

/// What one observation that takes no part costs, so that leaving much out does not pay.
const MISSING: f64 = 20.0;

/// Explanations of the images, the best first: few or planar features may leave several.
pub(crate) fn look(seed: u64, stages: &mut Stages<'_>) -> Result<Vec<Seen>, Error> {
    let setup = stages.setup;
    let on_arm = cameras_are_on_the_arm(setup);
    let scenes = scenes(setup, on_arm, seed);
    let mut explanations: Vec<Seen> = scenes.iter().filter_map(|scene| seen_from(setup, scene, on_arm)).collect();
    for width in WIDTHS {
        for seen in &mut explanations {
            refine(seen, on_arm, width, stages)?;
        }
        explanations.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        explanations.dedup_by(|a, b| a.cost - b.cost < SAME * b.cost);
    }
    explanations.truncate(KEPT);
    if explanations.is_empty() { Err(join::what_is_missing(setup)) } else { Ok(explanations) }
}

/// What cameras and features of the images that are looked at are fixed to.
fn frames(on_arm: bool) -> (Parent, Parent) {
    if on_arm { (Parent::Tip, Parent::World) } else { (Parent::World, Parent::Tip) }
}

fn scenes(setup: &Setup, on_arm: bool, seed: u64) -> Vec<Scene> {
    let model = &setup.model;
    let mut samples: Vec<Vec<Sighting>> = vec![Vec::new(); setup.len()];
    let every = setup.len().div_ceil(LOOK);
    for seen in setup.observations.iter().filter(|seen| seen.sample % every == 0) {
        let &Observation { sample, camera, feature, .. } = seen;
        if (model.cameras[camera].parent, model.features[feature].parent) != frames(on_arm) {
            continue;
        }
        let sightings = &mut samples[sample];
        // What a camera has both pixel and point of is one sighting.
        let same = sightings.iter_mut().find(|other| (other.camera, other.feature) == (camera, feature));
        if let Some(sighting) = same {
            sighting.point = seen.point();
        } else if let Some(bearing) = seen.bearing(model) {
            sightings.push(Sighting { camera, feature, bearing, point: seen.point() });
        }
    }
    let focals = model.cameras.iter().filter(|camera| camera.has_lens()).map(|camera| camera.intrinsics[0]);
    let threshold = (THRESHOLD * setup.sd(Kind::Pixels)).max(THRESHOLD_PX) / focals.fold(f64::INFINITY, f64::min);
    let (cameras, features) = (model.cameras.len(), model.features.len());
    reconstruct(&Views { samples: &samples, cameras, features, threshold, seed })
}

/// Bundle adjustment of what is seen, with the first camera and the first tip held.
fn refine(seen: &mut Seen, on_arm: bool, width: f64, stages: &mut Stages<'_>) -> Result<(), Error> {
    let setup = stages.setup;
    let mut freedom = Freedom::seen(setup);
    // Images alone tell little of intrinsics: those that are given are trusted until the chain is there.
    for (held, known) in freedom.intrinsics.iter_mut().zip(&setup.intrinsics) {
        *held = std::array::from_fn(|i| held[i] || i >= 2 || known.focal);
    }
    freedom.cameras[seen.cameras.iter().position(|placed| *placed).unwrap_or(0)] = [true; 6];
    freedom.states[seen.placed.iter().position(|placed| *placed).unwrap_or(0)] = true;
    let takes_part = |index: usize| takes_part(setup, seen, on_arm, &setup.observations[index]);
    let missing = (0..setup.observations.len()).filter(|&index| !takes_part(index)).count();
    let loss = Loss::Cauchy(width);
    let stage = Stage { name: "cameras and structure", freedom: &freedom, loss, takes_part: &takes_part };
    let mut state = seen.state.clone();
    let cost = MISSING * missing as f64 + stages.minimize(&stage, &mut state)?.final_cost;
    (seen.state, seen.cost) = (state, cost);
    Ok(())
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
    let mut state = State { tips: vec![Pose::identity(); setup.len()], ..State::new(setup) };
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
    let is_seen = placed.iter().filter(|placed| **placed).count() >= 3;
    let mut seen = is_seen.then(|| Seen {
        state,
        placed,
        cameras: scene.cameras.iter().map(Option::is_some).collect(),
        features: scene.features.iter().map(Option::is_some).collect(),
        cost: f64::INFINITY,
    })?;
    if let Some(scale) = measured_scale(setup, &seen, on_arm) {
        gauge::rescale(&mut seen.state, scale);
    }
    Some(seen)
}

/// What lengths must be multiplied by to be what depth cameras measured, in the median.
fn measured_scale(setup: &Setup, seen: &Seen, on_arm: bool) -> Option<f64> {
    let model = &seen.state.model;
    let mut ratios: Vec<f64> = Vec::new();
    for one in setup.observations.iter().filter(|one| takes_part(setup, seen, on_arm, one)) {
        let Some(point) = one.point() else { continue };
        let predicted = one.predicted(model, &[model.base, seen.state.tips[one.sample]]).norm();
        ratios.extend((predicted > 0.0).then(|| point.norm() / predicted));
    }
    let scale = median(&mut ratios);
    (scale > 0.0).then_some(scale)
}

/// True where everything that an observation hangs on is placed.
fn takes_part(setup: &Setup, seen: &Seen, on_arm: bool, one: &Observation) -> bool {
    let model = &setup.model;
    let parents = (model.cameras[one.camera].parent, model.features[one.feature].parent);
    parents == frames(on_arm) && seen.placed[one.sample] && seen.cameras[one.camera] && seen.features[one.feature]
}
