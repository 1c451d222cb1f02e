//! Random joint positions within the limits that have the features in view.
use super::views::{Need, Shortfall, Views};
use crate::Error;
use crate::chain::JointKind;
use crate::rig::{Joint, Rig};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Uniform draws before a walk towards the features is tried: enough wherever 1 % of all positions have them in view.
const DRAWS: usize = 500;

/// Steps of such a walk.
const STEPS: usize = 500;

/// Steps of a climb.
const CLIMB: usize = 100;

/// Draws and walks before giving up.
const RESTARTS: usize = 20;

/// Widths of the steps, in turn, as shares of the joints' ranges.
const WIDTHS: [f64; 3] = [0.3, 0.1, 0.03];

/// Draws positions one after the other.
pub(crate) struct Motions<'a> {
    views: &'a Views<'a>,
    camera_names: Vec<&'a str>,
    ranges: Vec<[f64; 2]>,
    random: ChaCha8Rng,
    /// Most features that each camera had in view in any position that was tried.
    most: Vec<usize>,
    tried: usize,
    found: usize,
}

impl<'a> Motions<'a> {
    /// `ranges`: smallest and largest reading of every joint.
    pub fn new(rig: &'a Rig, views: &'a Views<'a>, ranges: Vec<[f64; 2]>, random: ChaCha8Rng) -> Self {
        Motions {
            views,
            camera_names: rig.cameras.iter().map(|camera| camera.name.as_str()).collect(),
            ranges,
            random,
            most: vec![0; rig.cameras.len()],
            tried: 0,
            found: 0,
        }
    }

    /// The next position: uniform among those that have the features in view, or, where they are rare, found by a random
    /// walk from the best of many uniform ones towards the cameras' axes.
    pub fn draw(&mut self) -> Result<Vec<f64>, Error> {
        for _ in 0..RESTARTS {
            let mut joints = self.near(None, 1.0);
            let mut shortfall = self.shortfall(&joints);
            for trial in 1..DRAWS + STEPS {
                if shortfall.missing == 0 {
                    self.found += 1;
                    return Ok(joints);
                }
                let other = if trial < DRAWS {
                    self.near(None, 1.0)
                } else {
                    self.near(Some(&joints), WIDTHS[trial % WIDTHS.len()])
                };
                let there = self.shortfall(&other);
                if there <= shortfall {
                    (joints, shortfall) = (other, there);
                }
            }
        }
        Err(self.failure())
    }

    /// A position near by that scores more and has the features in view, by random steps uphill.
    pub fn climb(&mut self, from: &[f64], score: impl Fn(&[f64]) -> f64) -> Vec<f64> {
        let (mut joints, mut best) = (from.to_vec(), score(from));
        for step in 0..CLIMB {
            let other = self.near(Some(&joints), WIDTHS[step % WIDTHS.len()]);
            if self.shortfall(&other).missing > 0 {
                continue;
            }
            let there = score(&other);
            if there > best {
                (joints, best) = (other, there);
            }
        }
        joints
    }

    /// Uniform within the limits, and within a share of the ranges around a position where one is given.
    fn near(&mut self, joints: Option<&[f64]>, width: f64) -> Vec<f64> {
        let random = &mut self.random;
        let draw = |(index, &[lower, upper]): (usize, &[f64; 2])| match joints {
            None => random.random_range(lower..=upper),
            Some(joints) => {
                let reach = width * (upper - lower);
                random.random_range(lower.max(joints[index] - reach)..=upper.min(joints[index] + reach))
            }
        };
        self.ranges.iter().enumerate().map(draw).collect()
    }

    fn shortfall(&mut self, joints: &[f64]) -> Shortfall {
        let mut in_view = vec![0; self.most.len()];
        let shortfall = self.views.shortfall(joints, &mut in_view);
        self.most.iter_mut().zip(in_view).for_each(|(most, seen)| *most = seen.max(*most));
        self.tried += 1;
        shortfall
    }

    fn failure(&self) -> Error {
        let Views { need: Need { per_camera, in_one, in_total }, model, floor, .. } = self.views;
        let n_features = model.features.len();
        let blind: Vec<String> = self
            .camera_names
            .iter()
            .zip(&self.most)
            .filter(|&(_, most)| most < per_camera.max(in_one))
            .map(|(name, most)| format!("camera `{name}` sees at most {most} of {n_features}"))
            .collect();
        let which = if blind.is_empty() { "no camera is to blame alone".to_owned() } else { blind.join(", ") };
        let needs = [
            (*per_camera, format!("every camera has {per_camera} features in view")),
            (*in_one, format!("a camera has {in_one} features in view")),
            (*in_total, format!("{in_total} features are in view")),
        ];
        let height = floor.map(|floor| format!("nothing of the arm is below {floor} m"));
        let needed = needs.into_iter().filter(|(count, _)| *count > 0).map(|(_, words)| words).chain(height);
        let needed = needed.collect::<Vec<_>>().join(" and ");
        Error::NotEnoughData(format!(
            "{} of {} random positions within the joints' ranges are such that {needed}: {which}; cameras that look at \
             the features, or narrower limits of the joints, would do",
            self.found, self.tried
        ))
    }
}

/// Smallest and largest reading of a joint: its limits. Where it has none, `seen` is where it was before; without that, a
/// revolute joint takes any angle.
pub(crate) fn range(joint: &Joint, seen: Option<[f64; 2]>) -> Result<[f64; 2], Error> {
    let (lower, upper) = (joint.limits.lower, joint.limits.upper);
    let range = match (lower, upper, seen) {
        (Some(lower), Some(upper), _) => [lower, upper],
        (_, _, Some([least, most])) => [lower.unwrap_or(least), upper.unwrap_or(most)],
        _ if joint.kind == JointKind::Prismatic => {
            return Err(Error::Unusable(format!(
                "joint `{}` is prismatic and has no `limits = {{ lower, upper }}` to move between",
                joint.name
            )));
        }
        (lower, upper, None) => {
            let lower = lower.unwrap_or_else(|| upper.map_or(-PI, |upper| upper - 2.0 * PI));
            [lower, upper.unwrap_or(if joint.limits.lower.is_some() { lower + 2.0 * PI } else { PI })]
        }
    };
    if !(range[0] <= range[1] && (range[1] - range[0]).is_finite()) {
        return Err(Error::Unusable(format!("joint `{}` has no reading within its limits {range:?}", joint.name)));
    }
    Ok(range)
}
