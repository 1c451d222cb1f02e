//! Simulation: a complete rig to a recording of random motions, with stated noise and seed.
mod measure;
mod random_rig;
pub mod world;

pub use random_rig::random_rig;

use crate::Error;
use crate::reach::{Motions, Need, Views, range};
use crate::recording::{RecordedCamera, Recording, Sample, natural_order};
use crate::rig::{Model, Rig};
use handeye_solvers::Pose;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What to simulate. The noise is that of the rig's `[noise]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulateOptions {
    /// How many samples.
    pub samples: usize,
    /// Seed of every random choice: the same seed gives the same recording, bit for bit.
    pub seed: u64,
    /// Probability that a detection is missing, in [0, 1].
    pub missed: f64,
    /// Probability that a detection is anywhere in the image instead of where the feature is, in [0, 1]; that a point is up to half
    /// its distance off along each axis.
    pub outliers: f64,
    /// Share of the features that every camera has in view in every sample, in [0, 1].
    pub in_view: f64,
    /// Least number of features in view in every sample, summed over the cameras; all of them where that is fewer.
    pub min_features: usize,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        SimulateOptions { samples: 50, seed: 1, missed: 0.0, outliers: 0.0, in_view: 0.5, min_features: 4 }
    }
}

impl SimulateOptions {
    /// How many features have to be in view in every sample.
    fn need(&self, rig: &Rig) -> Need {
        let n_features = rig.features.len();
        Need {
            per_camera: (self.in_view * n_features as f64).ceil() as usize,
            in_total: self.min_features.min(n_features * rig.cameras.len()),
            ..Need::default()
        }
    }
}

/// A simulated recording, and what it would have been without noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// What was commanded, read and seen, with noise, missed detections and outliers.
    pub recording: Recording,
    /// The true joints, tip poses, pixels and points of the same samples; of every feature in view, missed or not.
    pub truth: Recording,
    /// How many detections of features in view are missing.
    pub missed: usize,
    /// How many detections are gross outliers.
    pub outliers: usize,
}

/// Records random joint positions of a complete rig, uniform within the limits where its features are in view.
///
/// Cameras see pixels, and depth cameras the points of the same features. A revolute joint without limits takes any angle in ±π. Joints are always recorded; tip poses, joint actions and pose
/// actions where the rig has noise for them. Noise, missed detections and outliers have random numbers of their own, so the
/// motions depend on the rig and the seed alone, and more samples begin with the fewer.
///
/// Errors: [`Error::Unusable`] where the rig is not complete or an option is out of range, [`Error::NotEnoughData`] where
/// hardly any position within the limits has the features in view.
pub fn simulate(rig: &Rig, options: &SimulateOptions) -> Result<Simulation, Error> {
    check(options)?;
    let model = Model::new(rig)?;
    let views = Views::new(rig, &model, options.need(rig))?;
    let ranges = rig.robot.joints.iter().map(|joint| range(joint, None)).collect::<Result<_, _>>()?;
    let mut motions = Motions::new(rig, &views, ranges, ChaCha8Rng::seed_from_u64(options.seed));
    let positions = (0..options.samples).map(|_| motions.draw()).collect::<Result<Vec<_>, _>>()?;
    let truth = record(rig, &model, &views, positions);
    let measure::Measured { recording, missed, outliers } = measure::measure(&truth, rig, options);
    Ok(Simulation { recording, truth, missed, outliers })
}

fn check(options: &SimulateOptions) -> Result<(), Error> {
    if options.samples == 0 {
        return Err(Error::Unusable("0 samples are asked for, at least 1 is needed".to_owned()));
    }
    for (name, share) in [("missed", options.missed), ("outliers", options.outliers), ("in_view", options.in_view)] {
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::Unusable(format!("`{name}` is a share between 0 and 1, found {share}")));
        }
    }
    Ok(())
}

/// What a perfect observer writes down: one sample a second.
fn record(rig: &Rig, model: &Model, views: &Views<'_>, positions: Vec<Vec<f64>>) -> Recording {
    let poses: Vec<Pose> = positions.iter().map(|joints| model.tip(joints)).collect();
    let acts_on_joints = rig.noise.joint_action > 0.0;
    let acts_on_pose = rig.noise.pose_action.is_noisy();
    let (features, places) = in_natural_order(rig);
    let sample = |index: usize| {
        let joints = &positions[index];
        let next = positions.get(index + 1);
        let pixels = views.detections(joints);
        let points = views.points(joints, &pixels);
        let mut sample = Sample {
            time: Some(index as f64),
            joints: Some(joints.clone()),
            pose: Some(poses[index]),
            joint_action: next
                .filter(|_| acts_on_joints)
                .map(|next| next.iter().zip(joints).map(|(next, now)| next - now).collect()),
            pose_action: poses.get(index + 1).filter(|_| acts_on_pose).map(|next| *next * poses[index].inverse()),
            pixels,
            points,
            ..Sample::default()
        };
        sample.pixels.iter_mut().for_each(|seen| seen.feature = places[seen.feature as usize]);
        sample.points.iter_mut().for_each(|seen| seen.feature = places[seen.feature as usize]);
        sample.pixels.sort_unstable_by_key(|seen| (seen.camera, seen.feature));
        sample.points.sort_unstable_by_key(|seen| (seen.camera, seen.feature));
        sample
    };
    Recording {
        joints: rig.robot.joint_names(),
        cameras: rig.cameras.iter().map(RecordedCamera::from).collect(),
        features,
        samples: (0..positions.len()).map(sample).collect(),
    }
}

/// The rig's features as recordings list them, and the place there of each.
fn in_natural_order(rig: &Rig) -> (Vec<String>, Vec<u32>) {
    let mut order: Vec<usize> = (0..rig.features.len()).collect();
    order.sort_by(|&a, &b| natural_order(&rig.features[a].name, &rig.features[b].name));
    let mut places = vec![0; order.len()];
    for (place, &index) in order.iter().enumerate() {
        places[index] = place as u32;
    }
    (order.iter().map(|&index| rig.features[index].name.clone()).collect(), places)
}
