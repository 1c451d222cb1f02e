//! What the servoing experiments share: cases, rigs learned from the controller itself, and the error after every command.
use super::setting::{HELD_OUT, learn, nothing};
use super::{Published, Row};
use crate::Error;
use crate::infer::Names;
use crate::recording::{Detection, Recording, Sample};
use crate::rig::{Limits, Model, PoseNoise, Rig};
use crate::servo::{Command, Controller, LoopSettings, Measurement, ServoLoop};
use crate::simulate::world::{Execution, Tracker, World, WorldOptions};
use crate::simulate::{SimulateOptions, simulate};
use handeye_solvers::Pose;

/// Targets per trial.
pub(super) const TARGETS: usize = 10;

/// What the rows of floors are.
pub(super) const FLOOR_NOTE: &str = "floor: the target plus one noisy motion, which no controller does better than";

/// Samples of the controller that a rig is learned from.
const SAMPLES: usize = 50;

/// Standard deviation of the trackers [px].
const PIXELS: f64 = 0.3;

/// Start and target joints with all features in view.
fn places(rig: &Rig, seed: u64) -> Result<Vec<[Vec<f64>; 2]>, Error> {
    let options = SimulateOptions { samples: 2 * TARGETS, seed, in_view: 1.0, ..SimulateOptions::default() };
    let joints: Vec<Vec<f64>> =
        simulate(rig, &options)?.truth.samples.into_iter().filter_map(|sample| sample.joints).collect();
    Ok(joints.chunks_exact(2).map(|pair| [pair[0].clone(), pair[1].clone()]).collect())
}

/// Mean true pixel distances over the targets of a trial [px].
pub(super) struct Servoed {
    /// Before the first command, and after each.
    pub errors: Vec<f64>,
    /// At the target plus one motion that should lead nowhere: no controller does better.
    pub floor: f64,
}

/// Servoes to the targets of a trial. `known`: the rig that the controllers know; `readings`: standard deviation of the joint readings.
pub(super) fn servo<C: Controller>(
    truth: &Rig,
    known: &Rig,
    (execution, readings, acts): (&Execution, Option<f64>, Acts),
    (seed, commands): (u64, usize),
    controller: impl Fn() -> Result<C, Error>,
) -> Result<Servoed, Error> {
    let mut servoed = Servoed { errors: vec![0.0; commands + 1], floor: 0.0 };
    for (index, [start, target]) in places(truth, seed ^ HELD_OUT)?.iter().enumerate() {
        let noise = seed.wrapping_mul(TARGETS as u64).wrapping_add(index as u64);
        let mut world = world(truth, start, execution, readings, noise)?;
        let all = errors(controller()?, known, &mut world, target, commands)?;
        servoed.errors.iter_mut().zip(all).for_each(|(mean, error)| *mean += error / TARGETS as f64);
        servoed.floor += floor(&mut world, &acts.still(truth), target)? / TARGETS as f64;
    }
    Ok(servoed)
}

/// A world of a rig whose arm has no limits, with trackers as good as those that it is learned from.
fn world(rig: &Rig, start: &[f64], execution: &Execution, readings: Option<f64>, seed: u64) -> Result<World, Error> {
    let mut free = rig.clone();
    free.robot.joints.iter_mut().for_each(|joint| joint.limits = Limits::default());
    let tracker = Tracker::Gaussian(PIXELS);
    World::new(
        &free,
        start,
        WorldOptions { execution: execution.clone(), readings, tracker, seed, ..WorldOptions::default() },
    )
}

/// Mean true pixel distance from the target before the first command and after each of `commands` [px].
fn errors<C: Controller>(
    controller: C,
    known: &Rig,
    world: &mut World,
    target: &[f64],
    commands: usize,
) -> Result<Vec<f64>, Error> {
    let names = Names::new(known, world.header());
    let endless = LoopSettings {
        window: 0,
        diverged: f64::INFINITY,
        timeout: f64::INFINITY,
        follow: true,
        ..LoopSettings::default()
    };
    let mut servo = ServoLoop::new(controller, endless);
    let goal = world.exact(target);
    servo.aim(&names.sightings(&Sample { pixels: goal.clone(), ..Sample::default() }));
    let mut errors = vec![distance(&world.exact(world.joints()), &goal)];
    for _ in 0..commands {
        let sample = world.look();
        let (joints, seen) = (sample.joints.unwrap_or_default(), sample.pixels);
        let seen = names.sightings(&Sample { pixels: seen, ..Sample::default() });
        let now = Measurement { time: world.time(), joints: &joints, seen: &seen, points: &[] };
        let tick = servo.tick(world.time(), &now, &[], 1.0)?;
        world.execute(&tick.command, 1.0)?;
        errors.push(distance(&world.exact(world.joints()), &goal));
    }
    Ok(errors)
}

/// Mean true pixel distance after a motion that should lead nowhere, from the target [px].
fn floor(world: &mut World, command: &Command, target: &[f64]) -> Result<f64, Error> {
    let goal = world.exact(target);
    let mut sum = 0.0;
    for _ in 0..TARGETS {
        world.place(target)?;
        world.execute(command, 1.0)?;
        sum += distance(&world.exact(world.joints()), &goal);
    }
    Ok(sum / TARGETS as f64)
}

/// Over the features that are in view in both; NaN where there is none.
fn distance(seen: &[Detection], goal: &[Detection]) -> f64 {
    let key = |detection: &Detection| (detection.camera, detection.feature);
    let (mut sum, mut count) = (0.0, 0.0);
    for detection in seen {
        if let Ok(index) = goal.binary_search_by_key(&key(detection), key) {
            let (a, b) = (detection.pixel, goal[index].pixel);
            sum += (a[0] - b[0]).hypot(a[1] - b[1]);
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { f64::NAN }
}

/// What a robot's actions are.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Acts {
    /// It moves its joints.
    Joints,
    /// It moves its tip.
    Tip,
}

impl Acts {
    /// A motion that leads nowhere.
    fn still(self, rig: &Rig) -> Command {
        match self {
            Acts::Joints => Command::JointDelta(vec![0.0; rig.robot.joints.len()]),
            Acts::Tip => Command::PoseDelta(Pose::identity()),
        }
    }
}

/// A rig that is learned from random actions of a noisy controller and what cameras saw, the state unobserved; `None` where the data do
/// not suffice.
pub(super) fn learned_from_controller(
    rig: &Rig,
    acts: Acts,
    execution: &Execution,
    seed: u64,
) -> Result<Option<Rig>, Error> {
    let options = SimulateOptions { samples: SAMPLES, seed, ..SimulateOptions::default() };
    let ways: Vec<Vec<f64>> =
        simulate(rig, &options)?.truth.samples.into_iter().filter_map(|sample| sample.joints).collect();
    let mut world = world(rig, &ways[0], execution, None, seed)?;
    let model = Model::new(rig)?;
    let mut recording = Recording { samples: Vec::with_capacity(SAMPLES), ..world.header().clone() };
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    for next in ways.iter().skip(1).map(Some).chain([None]) {
        let mut sample = world.look();
        if let Some(next) = next {
            let command = match acts {
                Acts::Joints => {
                    let action: Vec<f64> = next.iter().zip(world.joints()).map(|(to, from)| to - from).collect();
                    squares[0] += action.iter().map(|motion| motion * motion).sum::<f64>() / action.len() as f64;
                    sample.joint_action = Some(action.clone());
                    Command::JointDelta(action)
                }
                Acts::Tip => {
                    let (from, to) = (world.tip(), model.tip(next));
                    let action = to * from.inverse();
                    squares[1] += (to.translation - from.translation).norm_squared();
                    squares[2] += to.angle_to(&from).powi(2);
                    sample.pose_action = Some(action);
                    Command::PoseDelta(action)
                }
            };
            world.execute(&command, 1.0)?;
            count += 1.0;
        }
        recording.samples.push(sample);
    }
    let mut known = nothing(rig);
    known.noise.pixels = PIXELS;
    let sd = |constant: f64, squares: f64| constant.hypot(execution.share * (squares / count).sqrt());
    match acts {
        Acts::Joints => known.noise.joint_action = sd(execution.joints, squares[0]),
        Acts::Tip => {
            recording.joints.clear();
            let (xyz, rot) = (sd(execution.pose.xyz, squares[1]), sd(execution.pose.rot, squares[2]));
            known.noise.pose_action = PoseNoise { xyz, rot };
        }
    }
    Ok(learn(&known, &recording)?.map(|calibration| calibration.rig))
}

/// One row per command, and one of the floor.
pub(super) fn rows(
    series: &'static str,
    published: impl Fn(usize) -> Option<Published>,
    results: &[Option<Servoed>],
    commands: usize,
) -> Vec<Row> {
    let values =
        |of: &dyn Fn(&Servoed) -> f64| results.iter().map(|result| result.as_ref().map(of)).collect::<Vec<_>>();
    let row = |step: usize| {
        let label = format!("{series}, after {step} command{}", if step == 1 { "" } else { "s" });
        Row::new(label, published(step), &values(&|servoed| servoed.errors[step])).at(series, step as f64)
    };
    let floor = Row::new(format!("{series}, floor"), None, &values(&|servoed| servoed.floor));
    (0..=commands).map(row).chain([floor]).collect()
}
