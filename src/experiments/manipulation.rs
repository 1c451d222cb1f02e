//! A robot that errs grasps an object and inserts it, by its pixels: what the demonstrations of the paper share.
use super::setting::{learn, nothing, rig};
use crate::Error;
use crate::calibrate::{self, relearn};
use crate::infer::{InferOptions, Inference, Names, Prior, Sighting};
use crate::recording::Sample;
use crate::rig::{Feature, Limits, Parent, Rig};
use crate::servo::{Command, stretched};
use crate::simulate::world::{Execution, Tracker, World, WorldOptions};
use crate::simulate::{SimulateOptions, simulate};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// How the robot errs, in words.
pub(super) const ROBOT: &str = "joints err by 0.5 mrad and 5 % of every motion, their readings by 5 mrad";

/// Factors by which the structure is stretched on the way, one motion each (the paper: four attempts at 1.4, then one each).
pub(super) const STRETCH: [f64; 8] = [1.4, 1.4, 1.4, 1.4, 1.3, 1.2, 1.1, 1.0];

const READINGS: f64 = 5e-3;
const PIXELS: f64 = 0.3;

/// Samples that the rig and the object's structure are learned from.
const SAMPLES: usize = 50;
const FEW: usize = 5;

/// Features of the object, how far before the flange it is, and how far they are from its middle along each axis [m].
const OBJECT: usize = 6;
const REACH: f64 = 0.12;
const EXTENT: f64 = 0.03;

/// The true rig with an object in its hand and a hole: features of the arm, then of the object, then the two of the hole.
pub(super) struct Scene {
    truth: Rig,
    n_arm: usize,
}

impl Scene {
    /// The paper's rig, with an object of random features 12 cm before its flange, whose first two go into the hole.
    pub fn new(seed: u64) -> Result<Scene, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut truth = rig()?;
        truth.noise.joints = READINGS;
        truth.noise.pixels = PIXELS;
        let n_arm = truth.features.len();
        let mut place = || [0.0, 0.0, REACH].map(|centre| centre + random.random_range(-EXTENT..EXTENT));
        let object: Vec<[f64; 3]> = (0..OBJECT).map(|_| place()).collect();
        let feature = |name: String, xyz: [f64; 3]| Feature { name, parent: Parent::Tip, xyz: Some(xyz) };
        let of_object = object.iter().enumerate().map(|(index, xyz)| feature(format!("object{index}"), *xyz));
        let of_hole = object[..2].iter().enumerate().map(|(index, xyz)| feature(format!("hole{index}"), *xyz));
        truth.features.extend(of_object.chain(of_hole));
        Ok(Scene { truth, n_arm })
    }

    /// Indices of the object's features, in the true rig and in those that are learned.
    pub fn object(&self) -> Vec<usize> {
        (self.n_arm..self.n_arm + OBJECT).collect()
    }

    /// Indices of the hole's features in the true rig.
    pub fn hole(&self) -> Vec<usize> {
        (self.n_arm + OBJECT..self.truth.features.len()).collect()
    }

    /// Where the object's middle is in the hand [m].
    pub fn middle(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, REACH)
    }

    /// The true rig with its first features alone.
    fn first(&self, count: usize) -> Rig {
        Rig { features: self.truth.features[..count].to_vec(), ..self.truth.clone() }
    }

    /// The arm, learned from 50 samples; `None` where they do not suffice.
    pub fn learn_arm(&self, seed: u64) -> Result<Option<Rig>, Error> {
        let arm = self.first(self.n_arm);
        let options = SimulateOptions { samples: SAMPLES, seed, ..SimulateOptions::default() };
        Ok(learn(&nothing(&arm), &simulate(&arm, &options)?.recording)?.map(|calibration| calibration.rig))
    }

    /// The structure of the object that is held as `grip` says, learned from 5 samples with all else held; `None` where they do not
    /// suffice.
    pub fn learn_object(&self, arm: &Rig, grip: &Pose, seed: u64) -> Result<Option<Rig>, Error> {
        let mut held = self.first(self.n_arm + OBJECT);
        let mut known = arm.clone();
        known.features.truncate(self.n_arm);
        for feature in &mut held.features[self.n_arm..] {
            feature.xyz = feature.xyz.map(|xyz| grip.transform(&xyz.into()).into());
            known.features.push(Feature { xyz: None, ..feature.clone() });
        }
        let options = SimulateOptions { samples: FEW, seed, ..SimulateOptions::default() };
        let recording = simulate(&held, &options)?.recording;
        let watch = &mut |_: &calibrate::Progress<'_>| ControlFlow::Continue(());
        let paths: Vec<String> = held.features[self.n_arm..].iter().map(|f| format!("features.{}", f.name)).collect();
        match relearn(&known, &recording, &paths, &calibrate::Options::default(), watch) {
            Ok(calibration) => Ok(Some(calibration.rig)),
            Err(Error::NotEnoughData(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// A world of the true rig, whose arm has no limits, at random joints; and the pose of the tip at others.
    pub fn world(&self, seed: u64) -> Result<(World, Pose), Error> {
        let options = SimulateOptions { samples: 2, seed, in_view: 0.8, ..SimulateOptions::default() };
        let samples = simulate(&self.truth, &options)?.truth.samples;
        let mut free = self.truth.clone();
        free.robot.joints.iter_mut().for_each(|joint| joint.limits = Limits::default());
        let world = World::new(
            &free,
            samples[0].joints.as_deref().unwrap_or_default(),
            WorldOptions {
                execution: Execution { joints: 5e-4, share: 0.05, ..Execution::default() },
                readings: Some(READINGS),
                tracker: Tracker::Gaussian(PIXELS),
                seed,
                ..WorldOptions::default()
            },
        )?;
        Ok((world, samples[1].pose.unwrap_or_else(Pose::identity)))
    }
}

/// Brings the features of an object, as `known` has them in the hand, to where others are seen, by way of stretched structures.
///
/// `is_held`: the object's own pixels tell where the hand is, too. `to`: of a feature that is seen, the feature of the object that shall
/// come there.
pub(super) fn approach(
    known: &Rig,
    (object, is_held): (&[usize], bool),
    world: &mut World,
    to: &dyn Fn(&str) -> Option<usize>,
) -> Result<(), Error> {
    let header = world.header().clone();
    let names = Names::new(known, &header);
    let mut looks: BTreeMap<(usize, usize), ([f64; 2], f64)> = BTreeMap::new();
    for factor in STRETCH {
        let sample = world.look();
        let readings = sample.joints.clone().unwrap_or_default();
        for seen in &sample.pixels {
            if let Some(feature) = to(&header.features[seen.feature as usize]) {
                let (sum, count) = looks.entry((seen.camera as usize, feature)).or_insert(([0.0; 2], 0.0));
                *count += 1.0;
                sum.iter_mut().zip(seen.pixel).for_each(|(sum, coordinate)| *sum += coordinate);
            }
        }
        // What stands still is seen better the longer one looks.
        let mean = |(&(camera, feature), (sum, count)): (&(usize, usize), &([f64; 2], f64))| Sighting {
            camera,
            feature,
            pixel: sum.map(|sum| sum / count),
        };
        let goal: Vec<Sighting> = looks.iter().map(mean).collect();
        let mut arm = names.sightings(&Sample { pixels: sample.pixels, ..Sample::default() });
        arm.retain(|sighting| is_held || !object.contains(&sighting.feature));
        let now = nearest(known, &arm, &readings)?;
        let target = nearest(&stretched(known, object, factor), &goal, &now)?;
        let motion = target.iter().zip(&now).map(|(target, now)| target - now).collect();
        world.execute(&Command::JointDelta(motion), 1.0)?;
    }
    Ok(())
}

/// How far a point of the tip's frame is moved by a motion that should lead nowhere [m], the mean of several.
pub(super) fn jitter(world: &mut World, point: &Vector3<f64>) -> Result<f64, Error> {
    const MOTIONS: usize = 20;
    let still = Command::JointDelta(vec![0.0; world.joints().len()]);
    let mut sum = 0.0;
    for _ in 0..MOTIONS {
        let before = world.tip().transform(point);
        world.execute(&still, 1.0)?;
        sum += (world.tip().transform(point) - before).norm();
    }
    Ok(sum / MOTIONS as f64)
}

/// Joints that explain pixels: those near others, or where there are none, the most probable.
fn nearest(rig: &Rig, seen: &[Sighting], near: &[f64]) -> Result<Vec<f64>, Error> {
    let mut inference = Inference::new(rig, InferOptions::default())?;
    let local = inference.joints_near(seen, &Prior::start(near))?;
    if local.rms_px < EXPLAINED * PIXELS {
        return Ok(local.joints);
    }
    let best = inference.joints(seen, &Prior::start(near))?.into_iter().next();
    Ok(best.unwrap_or(local).joints)
}

/// Pixels that differ by more standard deviations are not explained.
const EXPLAINED: f64 = 5.0;
