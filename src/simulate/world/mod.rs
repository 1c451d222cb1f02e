//! Worlds for closed loops: a robot that carries out commands inexactly, cameras and trackers, things to grasp.
mod fault;
mod object;
mod robot;
mod tracker;

pub use fault::{Fault, FaultKind};
pub use object::Object;
pub use robot::Execution;
pub use tracker::Tracker;

use super::in_natural_order;
use crate::Error;
use crate::reach::{pixel_inside, sizes};
use crate::recording::{Command, Detection, RecordedCamera, Recording, Sample};
use crate::rig::{Model, ModelFeature, Parent, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use robot::Robot;
use std::collections::VecDeque;

/// How a world differs from its rig.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldOptions {
    /// How the robot errs.
    pub execution: Execution,
    /// Standard deviation of joint readings [rad or m]; `None` where the robot gives none.
    pub readings: Option<f64>,
    /// How trackers err.
    pub tracker: Tracker,
    /// Trackers that fail at times.
    pub faults: Vec<Fault>,
    /// Probability that a feature in view is not reported, in [0, 1].
    pub missed: f64,
    /// What is read and seen is this old [s].
    pub latency: f64,
    /// Seed of all that is random: the same seed and the same commands give the same world, bit for bit.
    pub seed: u64,
}

impl Default for WorldOptions {
    /// Everything is exact.
    fn default() -> Self {
        WorldOptions {
            execution: Execution::default(),
            readings: Some(0.0),
            tracker: Tracker::Exact,
            faults: Vec::new(),
            missed: 0.0,
            latency: 0.0,
            seed: 1,
        }
    }
}

/// A robot before its cameras.
pub struct World {
    model: Model,
    sizes: Vec<[f64; 2]>,
    header: Recording,
    /// Of every feature of the rig, its place in the header.
    places: Vec<u32>,
    robot: Robot,
    options: WorldOptions,
    objects: Vec<Object>,
    time: f64,
    joints: Vec<f64>,
    /// Where the joints and objects were, as long ago as the latency reaches.
    past: VecDeque<(f64, Vec<f64>, Vec<Object>)>,
    /// What trackers with faults reported last [px], in the order of the faults.
    reported: Vec<Option<[f64; 2]>>,
    executing: ChaCha8Rng,
    observing: ChaCha8Rng,
}

/// Streams of random numbers, so that what is seen does not change what is done.
const EXECUTING: u64 = 1;
const OBSERVING: u64 = 2;

impl World {
    /// A complete rig with its joints at these readings [rad or m], at time 0.
    ///
    /// Errors: [`Error::Unusable`] where the rig is not complete, a number is out of range, or the joints are not as many as the rig's.
    pub fn new(rig: &Rig, joints: &[f64], options: WorldOptions) -> Result<World, Error> {
        let model = Model::new(rig)?;
        let n = rig.robot.joints.len();
        check_joints(joints, n)?;
        options.execution.check(rig)?;
        let shares = [options.missed, options.readings.unwrap_or(0.0), options.latency];
        if !(0.0..=1.0).contains(&options.missed) || shares.iter().any(|number| !(0.0..f64::INFINITY).contains(number))
        {
            return Err(Error::Unusable(format!(
                "`missed` is a share between 0 and 1, noise of readings and latency are 0 or more; found {shares:?}"
            )));
        }
        let (features, places) = in_natural_order(rig);
        let stream = |number| {
            let mut random = ChaCha8Rng::seed_from_u64(options.seed);
            random.set_stream(number);
            random
        };
        Ok(World {
            sizes: sizes(rig)?,
            header: Recording {
                joints: rig.robot.joints.iter().map(|joint| joint.name.clone()).collect(),
                cameras: rig.cameras.iter().map(RecordedCamera::from).collect(),
                features,
                samples: Vec::new(),
            },
            places,
            robot: Robot {
                chain: model.joint_chain(),
                limits: rig.robot.joints.iter().map(|joint| joint.limits).collect(),
                execution: options.execution.clone(),
            },
            model,
            objects: Vec::new(),
            time: 0.0,
            joints: joints.to_vec(),
            past: VecDeque::from([(0.0, joints.to_vec(), Vec::new())]),
            reported: vec![None; options.faults.len()],
            executing: stream(EXECUTING),
            observing: stream(OBSERVING),
            options,
        })
    }

    /// Puts an object into the world, and gives its number.
    pub fn put(&mut self, object: Object) -> usize {
        self.objects.push(object);
        self.past = VecDeque::from([(self.time, self.joints.clone(), self.objects.clone())]);
        self.objects.len() - 1
    }

    /// Puts the arm at these joints [rad or m], without a motion.
    ///
    /// Errors: [`Error::Unusable`] where they are not as many as the robot's, or not finite.
    pub fn place(&mut self, joints: &[f64]) -> Result<(), Error> {
        check_joints(joints, self.joints.len())?;
        self.joints = joints.to_vec();
        self.past = VecDeque::from([(self.time, self.joints.clone(), self.objects.clone())]);
        Ok(())
    }

    /// Closes the gripper on an object, wherever it is: from now on it moves with the tip. Nothing happens for an unknown number.
    pub fn grasp(&mut self, object: usize) {
        let tip = self.robot.chain.tip(&self.joints);
        if let Some(object) = self.objects.get_mut(object) {
            object.grasp(&tip);
        }
    }

    /// An object, with where it is.
    pub fn object(&self, object: usize) -> Option<&Object> {
        self.objects.get(object)
    }

    /// Where a feature of the rig truly is [m]; NaN for one that there is not.
    pub fn feature(&self, feature: usize) -> Vector3<f64> {
        let is_known = feature < self.model.features.len();
        let links = self.model.links(&self.joints);
        if is_known { in_world(&self.model, feature, &links, &self.objects) } else { Vector3::repeat(f64::NAN) }
    }

    /// Seconds since the beginning.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Where the joints truly are [rad or m].
    pub fn joints(&self) -> &[f64] {
        &self.joints
    }

    /// Where the tip truly is, `world_from_tip`.
    pub fn tip(&self) -> Pose {
        self.robot.chain.tip(&self.joints)
    }

    /// Mean distance of what the joints move (features on the arm, cameras on it) from where it would be at other joints [m]; 0 where
    /// there is none of it.
    pub fn distance(&self, joints: &[f64]) -> f64 {
        let places = |joints: &[f64]| {
            let links = self.model.links(joints);
            let features = self.model.features.iter().filter(|feature| feature.parent != Parent::World);
            let cameras = self.model.cameras.iter().filter(|camera| camera.parent != Parent::World);
            let features = features.map(|feature| self.model.carrier(feature.parent, &links).transform(&feature.xyz));
            let cameras = cameras.map(|camera| (self.model.carrier(camera.parent, &links) * camera.pose).translation);
            features.chain(cameras).collect::<Vec<_>>()
        };
        let (here, there) = (places(&self.joints), places(joints));
        let sum: f64 = here.iter().zip(&there).map(|(a, b)| (a - b).norm()).sum();
        sum / here.len().max(1) as f64
    }

    /// A recording without samples: the names to which those of [`World::look`] refer.
    pub fn header(&self) -> &Recording {
        &self.header
    }

    /// What is read and seen now, with noise; its time is when it was, which latency puts into the past.
    pub fn look(&mut self) -> Sample {
        let time = (self.time - self.options.latency).max(0.0);
        let (joints, objects) = self.then(time);
        let random = &mut self.observing;
        let reading =
            |joint: &f64, sd: f64, random: &mut ChaCha8Rng| joint + sd * random.sample::<f64, _>(StandardNormal);
        let readings =
            self.options.readings.map(|sd| joints.iter().map(|joint| reading(joint, sd, random)).collect::<Vec<_>>());
        let mut pixels = detections(&self.model, &self.sizes, &self.places, &joints, &objects);
        let (tracker, missed) = (self.options.tracker, self.options.missed);
        pixels.retain_mut(|detection| {
            // As many random numbers whatever happens.
            let is_seen = random.random::<f64>() >= missed;
            detection.pixel = tracker.report(detection.pixel, random);
            is_seen
        });
        for (fault, reported) in self.options.faults.iter().zip(&mut self.reported) {
            let Some(&feature) = self.places.get(fault.feature) else { continue };
            let of_fault = |seen: &Detection| (seen.camera as usize, seen.feature) == (fault.camera, feature);
            if let Some(at) = pixels.iter().position(of_fault) {
                match fault.report(pixels[at].pixel, *reported, time) {
                    Some(pixel) => (pixels[at].pixel, *reported) = (pixel, Some(pixel)),
                    None => drop(pixels.remove(at)),
                }
            }
        }
        Sample { time: Some(time), joints: readings, pixels, ..Sample::default() }
    }

    /// What would be seen at some joints, exactly.
    pub fn exact(&self, joints: &[f64]) -> Vec<Detection> {
        detections(&self.model, &self.sizes, &self.places, joints, &self.objects)
    }

    /// Carries out a command, which takes `dt` seconds.
    ///
    /// Errors: [`Error::Unusable`] for a command that is not of this robot or has numbers that are not finite.
    pub fn execute(&mut self, command: &Command, dt: f64) -> Result<(), Error> {
        self.joints = self.robot.execute(&self.joints, command, dt, &mut self.executing)?;
        self.time += dt;
        self.past.push_back((self.time, self.joints.clone(), self.objects.clone()));
        while self.past.len() > 2 && self.past[1].0 <= self.time - self.options.latency {
            self.past.pop_front();
        }
        Ok(())
    }

    /// Joints and objects at a time that is remembered: commands move the joints evenly.
    fn then(&self, time: f64) -> (Vec<f64>, Vec<Object>) {
        let after = self.past.iter().position(|(when, ..)| *when >= time).unwrap_or(self.past.len() - 1);
        let (t1, j1, objects) = &self.past[after];
        let (t0, j0, _) = &self.past[after.saturating_sub(1)];
        let share = if t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 1.0 };
        (j0.iter().zip(j1).map(|(from, to)| from + share * (to - from)).collect(), objects.clone())
    }
}

fn check_joints(joints: &[f64], n: usize) -> Result<(), Error> {
    if joints.len() != n || joints.iter().any(|joint| !joint.is_finite()) {
        return Err(Error::Unusable(format!("a robot of {n} joints cannot be at {joints:?}")));
    }
    Ok(())
}

/// Exact pixels of all features in view, in the order of recordings.
fn detections(model: &Model, sizes: &[[f64; 2]], places: &[u32], joints: &[f64], objects: &[Object]) -> Vec<Detection> {
    let links = model.links(joints);
    let in_world: Vec<_> = (0..model.features.len()).map(|feature| in_world(model, feature, &links, objects)).collect();
    let mut seen = Vec::new();
    for (index, camera) in model.cameras.iter().enumerate() {
        let world_from_camera = model.carrier(camera.parent, &links) * camera.pose;
        for (point, &feature) in in_world.iter().zip(places) {
            let pixel = pixel_inside(camera, sizes[index], &world_from_camera.inverse_transform(point));
            seen.extend(pixel.map(|pixel| Detection { camera: index as u32, feature, pixel }));
        }
    }
    seen.sort_unstable_by_key(|detection| (detection.camera, detection.feature));
    seen
}

/// Where a feature is, on its link or on its object [m].
fn in_world(model: &Model, feature: usize, links: &[Pose], objects: &[Object]) -> Vector3<f64> {
    let object = objects.iter().find(|object| object.features.contains(&feature));
    let tip = model.carrier(Parent::Tip, links);
    let ModelFeature { parent, xyz } = &model.features[feature];
    let carrier = object.map_or_else(|| model.carrier(*parent, links), |object| object.carrier(&tip));
    carrier.transform(xyz)
}
