//! Combinations of numbers that the data leave open: in words and numbers, what they cost at the tip, and what would help.
use super::deviations::{Honest, name};
use super::graph::{Built, State, row};
use crate::chain::JointKind;
use crate::rig::Model;
use handeye_solvers::{Pose, Variable, WeakDirection, Weakness};
use std::f64::consts::PI;

/// Numbers of a rig that can move together without the data objecting much.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Parameter paths and how far each moves, in its own unit; the largest first and 1.
    pub numbers: Vec<(String, f64)>,
    /// What determines it.
    pub determined_by: DeterminedBy,
    /// Standard deviation of the tip's position that comes of it, root mean square over the recorded samples [m, or the
    /// model's unit]; `None` where nothing bounds it.
    pub tip: Option<f64>,
    /// What would determine it at the least expense, in words.
    pub cure: String,
}

/// What determines a combination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeterminedBy {
    /// Nothing.
    Nothing,
    /// A prior more than the data: the standard deviation from the data over that from the priors, infinite where the data
    /// say nothing.
    Prior(f64),
}

/// Combinations that are put in words, and how many numbers each names.
const DIRECTIONS: usize = 6;
const NAMED: usize = 4;

/// A joint that moved over less than this says little of its own axis.
const LITTLE: f64 = PI / 6.0; // rad
const LITTLE_TRAVEL: f64 = 0.1; // m

/// A length that a ruler or a drawing gives is known to this.
const RULER: f64 = 5e-4; // m

/// Steps that derivatives along a direction are taken with, as a share of it.
const STEP: f64 = 1e-5;

impl Combination {
    pub(crate) fn new(honest: &Honest<'_>, state: &State, built: &Built, weak: &WeakDirection) -> Self {
        let setup = &honest.setup;
        let part = |part: &handeye_solvers::Component| (name(setup, built, part.node, part.coordinate), part.weight);
        let samples: Vec<usize> = (0..setup.len()).collect();
        let motion = tip_motion(honest, state, built, weak, &samples);
        let rms = |all: Vec<f64>| (all.iter().map(|x| x * x).sum::<f64>() / all.len().max(1) as f64).sqrt();
        Combination {
            numbers: weak.components.iter().map(part).collect(),
            determined_by: match weak.kind {
                Weakness::Open => DeterminedBy::Nothing,
                Weakness::Prior => DeterminedBy::Prior(weak.sd_ratio),
            },
            tip: motion.map(rms),
            cure: cure(honest, state, built, weak),
        }
    }
}

impl std::fmt::Display for Combination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.determined_by {
            DeterminedBy::Nothing => write!(f, "nothing determines ")?,
            DeterminedBy::Prior(ratio) if ratio > 1e3 => write!(f, "only a prior determines ")?,
            DeterminedBy::Prior(ratio) => write!(f, "a prior more than the data ({ratio:.1} to 1) determines ")?,
        }
        let names: Vec<&str> = self.numbers.iter().take(NAMED).map(|(name, _)| name.as_str()).collect();
        let kind = if self.numbers.len() == 1 { "" } else { "a combination of " };
        write!(f, "{kind}{}", names.join(", "))?;
        if self.numbers.len() > NAMED {
            write!(f, " and {} more", self.numbers.len() - NAMED)?;
        }
        if !self.cure.is_empty() {
            write!(f, "; {}", self.cure)?;
        }
        Ok(())
    }
}

/// The weakest, and how many there are besides.
pub(crate) fn in_words(all: &[Combination]) -> Vec<String> {
    let mut words: Vec<String> = all.iter().take(DIRECTIONS).map(Combination::to_string).collect();
    if all.len() > DIRECTIONS {
        words.push(format!("and {} combinations more like these", all.len() - DIRECTIONS));
    }
    words
}

/// How far the tip of each sample moves in one standard deviation of a direction; `None` where nothing bounds it.
pub(crate) fn tip_motion(
    honest: &Honest<'_>,
    state: &State,
    built: &Built,
    weak: &WeakDirection,
    samples: &[usize],
) -> Option<Vec<f64>> {
    let sd = deviation(honest, built, weak)?;
    let tip = |model: &Model, sample: usize| {
        if honest.setup.states.chain { model.tip(&state.joints[sample]) } else { state.tips[sample] }.translation
    };
    let (ahead, behind) = (moved(state, built, weak, STEP), moved(state, built, weak, -STEP));
    Some(samples.iter().map(|&s| (tip(&ahead, s) - tip(&behind, s)).norm() * sd / (2.0 * STEP)).collect())
}

/// Standard deviation along a direction: with the priors' information p along it, the data's is p/ratio².
fn deviation(honest: &Honest<'_>, built: &Built, weak: &WeakDirection) -> Option<f64> {
    let priors = honest.priors;
    let sigma = |node: usize, k: usize| {
        let cameras = built.cameras.iter().enumerate();
        let camera = cameras.clone().find(|(_, (pose, _))| pose.index() == node).map(|(c, _)| priors.cameras[c][k]);
        let lens = || cameras.clone().find(|(_, (_, lens))| lens.index() == node).map(|(c, _)| priors.intrinsics[c][k]);
        let feature = || built.features.iter().position(|key| key.index() == node).map(|f| priors.features[f][k]);
        match node {
            node if node == built.base.index() => priors.base[k],
            node if node == built.parameters.index() => priors.parameters[k],
            _ => camera.or_else(lens).or_else(feature).unwrap_or(f64::INFINITY),
        }
    };
    let parts = weak.components.iter().map(|part| (part.weight / sigma(part.node, part.coordinate)).powi(2));
    let information = parts.sum::<f64>() * (1.0 + weak.sd_ratio.powi(-2));
    (weak.kind == Weakness::Prior && information > 0.0).then(|| information.sqrt().recip())
}

/// The model moved along a direction.
fn moved(state: &State, built: &Built, weak: &WeakDirection, by: f64) -> Model {
    let mut model = state.model.clone();
    let of = |node: usize| -> Vec<(usize, f64)> {
        let parts = weak.components.iter().filter(|part| part.node == node);
        parts.map(|part| (part.coordinate, by * part.weight)).collect()
    };
    for (coordinate, step) in of(built.parameters.index()) {
        model.parameters[coordinate] += step;
    }
    model.base = stepped(&model.base, &of(built.base.index()));
    for (camera, (pose, _)) in model.cameras.iter_mut().zip(&built.cameras) {
        camera.pose = stepped(&camera.pose, &of(pose.index()));
    }
    for (feature, key) in model.features.iter_mut().zip(&built.features) {
        of(key.index()).into_iter().for_each(|(coordinate, step)| feature.xyz[coordinate] += step);
    }
    model
}

fn stepped(pose: &Pose, parts: &[(usize, f64)]) -> Pose {
    let mut stored = vec![0.0; pose.ambient()];
    Pose::store(pose, &mut stored);
    Pose::retract::<f64>(&stored, |k| parts.iter().filter(|(at, _)| *at == k).map(|(_, step)| step).sum())
}

/// The distance that the direction changes most in terms of how well one can measure it, or the motion that is missing.
fn cure(honest: &Honest<'_>, state: &State, built: &Built, weak: &WeakDirection) -> String {
    if let Some(length) = length_cure(honest, state, built, weak) {
        return length;
    }
    motion_cure(honest, state, built, weak).unwrap_or_default()
}

fn length_cure(honest: &Honest<'_>, state: &State, built: &Built, weak: &WeakDirection) -> Option<String> {
    let sd = deviation(honest, built, weak)?;
    let (ahead, behind) = (moved(state, built, weak, STEP), moved(state, built, weak, -STEP));
    let rig = &honest.setup.rig;
    let mut best: Option<(f64, String)> = None;
    for (i, first) in rig.features.iter().enumerate() {
        for (k, second) in rig.features.iter().enumerate().skip(i + 1).filter(|(_, other)| other.parent == first.parent)
        {
            let between = |model: &Model| (model.features[i].xyz - model.features[k].xyz).norm();
            let change = (between(&ahead) - between(&behind)).abs() * sd / (2.0 * STEP);
            if change > best.as_ref().map_or(3.0 * RULER, |(most, _)| *most) {
                best = Some((change, format!("the distance between features `{}` and `{}`", first.name, second.name)));
            }
        }
    }
    let (change, what) = best?;
    Some(format!("measure {what}: it is known to {:.1} mm along this", 1e3 * change))
}

fn motion_cure(honest: &Honest<'_>, state: &State, built: &Built, weak: &WeakDirection) -> Option<String> {
    let setup = &honest.setup;
    if !setup.states.chain {
        return None;
    }
    let joints = weak.components.iter().filter(|part| part.node == built.parameters.index());
    let mut involved: Vec<usize> = joints.map(|part| part.coordinate / row(1)).collect();
    involved.extend(involved.clone().iter().map(|joint| joint + 1).filter(|next| *next < setup.model.chain.len()));
    let range = |joint: usize| {
        let values = state.joints.iter().map(|joints| joints[joint]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    let given = &setup.rig.robot.joints;
    let enough = |joint: usize| if given[joint].kind == JointKind::Prismatic { LITTLE_TRAVEL } else { LITTLE };
    let share = |joint: usize| range(joint) / enough(joint);
    let least = involved.into_iter().min_by(|a, b| share(*a).total_cmp(&share(*b)).then(a.cmp(b)))?;
    if share(least) >= 1.0 {
        return None;
    }
    let name = &given[least].name;
    Some(if given[least].kind == JointKind::Prismatic {
        format!("joint `{name}` moved only {:.0} mm: move it over {:.0} mm", 1e3 * range(least), 2e3 * LITTLE_TRAVEL)
    } else {
        format!(
            "joint `{name}` moved only {:.0} degrees: rotate it over {:.0} degrees",
            range(least).to_degrees(),
            2.0 * LITTLE.to_degrees()
        )
    })
}
