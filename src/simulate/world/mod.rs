//! Worlds for closed loops: a robot that carries out commands inexactly, cameras and trackers, things to grasp; an arm that a virtual spring
//! pulls, a drone over a line.
mod drone;
mod fault;
mod object;
mod robot;
mod sight;
mod slip;
mod spring;
mod tracker;

pub use drone::Drone;
pub use fault::{Fault, FaultKind};
pub use object::Object;
pub use robot::{Coupling, Execution};
pub use slip::Slip;
pub use spring::{Spring, SpringArm, Table};
pub use tracker::Tracker;

use super::in_natural_order;
use crate::Error;
use crate::reach::sizes;
use crate::recording::{Command, RecordedCamera, Recording};
use crate::rig::{Model, Parent, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use robot::Robot;
use sight::{Report, in_world};
use std::collections::VecDeque;

/// How a world differs from its rig.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldOptions {
    /// How the robot errs.
    pub execution: Execution,
    /// Joints that slip.
    pub slips: Vec<Slip>,
    /// Standard deviation of joint readings [rad or m]; `None` where the robot gives none.
    pub readings: Option<f64>,
    /// How trackers err.
    pub tracker: Tracker,
    /// Standard deviation of a coordinate of a point that a depth camera sees [m].
    pub points: f64,
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
            slips: Vec::new(),
            readings: Some(0.0),
            tracker: Tracker::Exact,
            points: 0.0,
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
    /// Which cameras give points too.
    depth: Vec<bool>,
    header: Recording,
    /// Of every feature of the rig, its place in the header.
    places: Vec<u32>,
    robot: Robot,
    options: WorldOptions,
    objects: Vec<Object>,
    time: f64,
    joints: Vec<f64>,
    /// How far each link has slipped from where its joint is read [rad or m].
    slipped: Vec<f64>,
    /// How it was, as long ago as the latency reaches.
    past: VecDeque<Moment>,
    /// What trackers with faults reported last, in the order of the faults.
    reported: Vec<Option<Report>>,
    executing: ChaCha8Rng,
    observing: ChaCha8Rng,
    sounding: ChaCha8Rng,
}

/// What is seen depends on.
#[derive(Clone)]
struct Moment {
    time: f64,
    joints: Vec<f64>,
    slipped: Vec<f64>,
    objects: Vec<Object>,
}

/// Streams of random numbers, so that what is seen does not change what is done.
const EXECUTING: u64 = 1;
const OBSERVING: u64 = 2;
const SOUNDING: u64 = 3;

impl World {
    /// A complete rig with its joints at these readings [rad or m], at time 0.
    ///
    /// Errors: [`Error::Unusable`] where the rig is not complete, a number is out of range, or the joints are not as many as the rig's.
    pub fn new(rig: &Rig, joints: &[f64], options: WorldOptions) -> Result<World, Error> {
        let model = Model::new(rig)?;
        let n = rig.robot.joints.len();
        check_joints(joints, n)?;
        options.execution.check(rig)?;
        options.tracker.check()?;
        let shares = [options.missed, options.readings.unwrap_or(0.0), options.points, options.latency];
        if !(0.0..=1.0).contains(&options.missed) || shares.iter().any(|number| !(0.0..f64::INFINITY).contains(number))
        {
            return Err(Error::Unusable(format!(
                "`missed` is a share between 0 and 1, noise of readings and points and latency are 0 or more; found {shares:?}"
            )));
        }
        options.slips.iter().try_for_each(|slip| slip.check(n))?;
        options.faults.iter().try_for_each(|fault| fault.check(rig))?;
        let (features, places) = in_natural_order(rig);
        let stream = |number| {
            let mut random = ChaCha8Rng::seed_from_u64(options.seed);
            random.set_stream(number);
            random
        };
        Ok(World {
            sizes: sizes(rig)?,
            depth: rig.cameras.iter().map(|camera| camera.depth).collect(),
            header: Recording {
                joints: rig.robot.joint_names(),
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
            slipped: vec![0.0; n],
            past: VecDeque::from([Moment {
                time: 0.0,
                joints: joints.to_vec(),
                slipped: vec![0.0; n],
                objects: Vec::new(),
            }]),
            reported: vec![None; options.faults.len()],
            executing: stream(EXECUTING),
            observing: stream(OBSERVING),
            sounding: stream(SOUNDING),
            options,
        })
    }

    /// Puts an object into the world, and gives its number.
    pub fn put(&mut self, object: Object) -> usize {
        self.objects.push(object);
        self.past = VecDeque::from([self.now()]);
        self.objects.len() - 1
    }

    /// Puts the arm at these joints [rad or m], without a motion.
    ///
    /// Errors: [`Error::Unusable`] where they are not as many as the robot's, or not finite.
    pub fn place(&mut self, joints: &[f64]) -> Result<(), Error> {
        check_joints(joints, self.joints.len())?;
        self.joints = joints.to_vec();
        self.past = VecDeque::from([self.now()]);
        Ok(())
    }

    /// Closes the gripper on an object, wherever it is: from now on it moves with the tip. Nothing happens for an unknown number.
    pub fn grasp(&mut self, object: usize) {
        let tip = self.robot.chain.tip(&self.joints);
        if let Some(object) = self.objects.get_mut(object) {
            object.grasp(&tip);
        }
    }

    /// Puts an object that is not held elsewhere, as somebody's hand does: where a tip at this pose of the world would hold it as it should
    /// be held. Nothing happens for an unknown number.
    pub fn carry(&mut self, object: usize, world_from_tip: Pose) {
        if let Some(object) = self.objects.get_mut(object) {
            object.carry(world_from_tip);
        }
        if let Some(last) = self.past.back_mut() {
            last.objects.clone_from(&self.objects);
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

    /// Where all features truly are [m], in the order of the header.
    pub fn features(&self) -> Vec<Vector3<f64>> {
        let links = self.model.links(&self.joints);
        let mut features = vec![Vector3::zeros(); self.places.len()];
        for (feature, place) in self.places.iter().enumerate() {
            features[*place as usize] = in_world(&self.model, feature, &links, &self.objects);
        }
        features
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
        self.apart(&self.model.links(joints))
    }

    /// The same of what is fixed to the tip, from where it would be with the tip at another pose of the world.
    pub fn distance_from_tip(&self, world_from_tip: &Pose) -> f64 {
        self.apart(&self.links_with_tip(world_from_tip))
    }

    fn apart(&self, there: &[Pose]) -> f64 {
        let here = self.model.links(&self.joints);
        let (features, cameras) = (self.model.features.iter().enumerate(), self.model.cameras.iter());
        let is_thing = |feature: &usize| self.objects.iter().any(|object| object.features.contains(feature));
        let features = features
            .filter(|(index, feature)| feature.parent != Parent::World && !is_thing(index))
            .map(|(_, feature)| (feature.parent, feature.xyz));
        let cameras = cameras.filter(|camera| camera.parent != Parent::World);
        let cameras = cameras.map(|camera| (camera.parent, camera.pose.translation));
        let place =
            |parent: Parent, xyz: &Vector3<f64>, links: &[Pose]| self.model.carrier(parent, links).transform(xyz);
        let (mut sum, mut count) = (0.0, 0);
        for (parent, xyz) in features.chain(cameras) {
            sum += (place(parent, &xyz, &here) - place(parent, &xyz, there)).norm();
            count += 1;
        }
        sum / f64::from(count.max(1))
    }

    /// Links as they are, but for the last, which is elsewhere.
    fn links_with_tip(&self, world_from_tip: &Pose) -> Vec<Pose> {
        let mut links = self.model.links(&self.joints);
        links.last_mut().into_iter().for_each(|tip| *tip = *world_from_tip);
        links
    }

    /// A recording without samples: the names to which those of [`World::look`] refer.
    pub fn header(&self) -> &Recording {
        &self.header
    }

    /// Carries out a command, which takes `dt` seconds.
    ///
    /// Errors: [`Error::Unusable`] for a command that is not of this robot or has numbers that are not finite.
    pub fn execute(&mut self, command: &Command, dt: f64) -> Result<(), Error> {
        // The robot goes by what it reads.
        let read: Vec<f64> = self.joints.iter().zip(&self.slipped).map(|(joint, slip)| joint - slip).collect();
        let after = self.robot.execute(&read, command, dt, &mut self.executing)?;
        let span = self.time..self.time + dt;
        for slip in self.options.slips.iter().filter(|slip| span.contains(&slip.at)) {
            self.slipped[slip.joint] += slip.by;
        }
        self.joints = after.iter().zip(&self.slipped).map(|(joint, slip)| joint + slip).collect();
        self.time += dt;
        self.past.push_back(self.now());
        while self.past.len() > 2 && self.past[1].time <= self.time - self.options.latency {
            self.past.pop_front();
        }
        Ok(())
    }

    fn now(&self) -> Moment {
        let (joints, slipped, objects) = (self.joints.clone(), self.slipped.clone(), self.objects.clone());
        Moment { time: self.time, joints, slipped, objects }
    }

    /// How it was at a time that is remembered: commands move the joints evenly, and whoever carries things about moves these so.
    fn then(&self, time: f64) -> Moment {
        let after = self.past.iter().position(|moment| moment.time >= time).unwrap_or(self.past.len() - 1);
        let (to, from) = (&self.past[after], &self.past[after.saturating_sub(1)]);
        let share =
            if to.time > from.time { ((time - from.time) / (to.time - from.time)).clamp(0.0, 1.0) } else { 1.0 };
        let between = |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect();
        let (joints, slipped) = (between(&from.joints, &to.joints), between(&from.slipped, &to.slipped));
        let objects = from.objects.iter().zip(&to.objects).map(|(a, b)| a.between(b, share)).collect();
        Moment { time, joints, slipped, objects }
    }
}

fn check_joints(joints: &[f64], n: usize) -> Result<(), Error> {
    if joints.len() != n || joints.iter().any(|joint| !joint.is_finite()) {
        return Err(Error::Unusable(format!("a robot of {n} joints cannot be at {joints:?}")));
    }
    Ok(())
}
