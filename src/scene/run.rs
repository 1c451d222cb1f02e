//! Running a scene.
use super::check::check;
use super::place::Setting;
use super::{Control, Scene, UncalibratedControl};
use crate::Error;
use crate::infer::{Names, Sighting};
use crate::recording::{Detection, Recording, Sample};
use crate::rig::Rig;
use crate::servo::{Active, Command, Constraint, Controller, Limit, Measurement, ServoLoop, Stop};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// What happened in a scene.
#[derive(Clone, Debug)]
pub struct Run {
    /// Every measurement in turn.
    pub moments: Vec<Moment>,
    /// Why the loop stopped.
    pub stop: Stop,
    /// How many commands moved the robot.
    pub commands: usize,
    /// What the limits are called, in the order in which [`Active`] counts them.
    pub limits: Vec<String>,
    /// Names and image sizes to which the detections of the moments refer.
    pub header: Recording,
}

/// One measurement, and what followed from it.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Seconds since the beginning.
    pub time: f64,
    /// Mean pixel distance of the features from the goal as the loop sees it [px], of a task the root of the mean square of its rows; `None`
    /// where none is seen.
    pub error_px: Option<f64>,
    /// Mean distance in space of what moves (features on the arm, cameras on it) from where it shall be, in truth [m]; of a task, from where
    /// the scene's target has it, which is one of the places that solve it.
    pub error_m: f64,
    /// Where the joints truly are [rad or m].
    pub joints: Vec<f64>,
    /// Where the features truly are [m], in the order of the header.
    pub features: Vec<Vector3<f64>>,
    /// What is seen.
    pub pixels: Vec<Detection>,
    /// What is aimed at; of a task, where what is on the hand would be seen.
    pub goal: Vec<Detection>,
    /// What holds the motion back.
    pub active: Vec<Active>,
    /// Constraints that cannot all hold, where a limit gave way.
    pub conflict: Vec<Constraint>,
    /// What the robot was told.
    pub command: Command,
    /// Why it waits, where it does.
    pub waits: Option<String>,
}

/// Runs a scene with a controller that knows `known`; what `watch` says of every moment may break it off. Without a rig that is known, the
/// controller is uncalibrated, and only names and joint limits of the scene's own rig are told.
///
/// Errors: [`Error::Unusable`] where rig and scene do not fit, or the scene's controller needs a rig and none is known;
/// [`Error::Cancelled`]; those of the controller.
pub fn run(
    known: Option<&Rig>,
    scene: &Scene,
    watch: &mut dyn FnMut(&Moment) -> ControlFlow<()>,
) -> Result<Run, Error> {
    let default = match known {
        Some(_) if scene.task.is_none() => Control::ModelBased,
        _ => Control::Uncalibrated(UncalibratedControl::default()),
    };
    let control = scene.control.clone().unwrap_or(default);
    let (learned, known) = match (known, &scene.rig) {
        (Some(known), _) => (Some(known), known),
        (None, Some(truth)) => (None, truth),
        (None, None) => {
            return Err(Error::Unusable("the scene names no `rig`, so there is no world: give one".to_owned()));
        }
    };
    let truth = scene.rig.as_ref().unwrap_or(known);
    check(scene, &control, truth, known)?;
    // What does not fit is said of the world before it is of the controller.
    let setting = Setting::new(scene, truth, known)?;
    run_in(setting, scene.controller(&control, learned, known)?, known, scene, watch)
}

fn run_in(
    mut setting: Setting,
    controller: Box<dyn Controller>,
    known: &Rig,
    scene: &Scene,
    watch: &mut dyn FnMut(&Moment) -> ControlFlow<()>,
) -> Result<Run, Error> {
    let names = Names::new(&setting.names, setting.header());
    let (limit_names, limits): (Vec<String>, Vec<Box<dyn Limit>>) = scene.limits(known).into_iter().unzip();
    let limits: Vec<&dyn Limit> = limits.iter().map(|limit| &**limit as &dyn Limit).collect();
    let mut servo = ServoLoop::new(controller, scene.settings);
    let (mut moments, mut commands) = (Vec::new(), 0);
    loop {
        let (goal, error_m) = setting.aim(scene);
        if scene.task.is_none() {
            servo.aim(&sightings(&names, &goal));
        }
        let world = &mut setting.world;
        let sample = world.look();
        let (seen, points) = (names.sightings(&sample), names.points(&sample));
        let readings = sample.joints.as_deref().unwrap_or_default();
        let now = Measurement { time: sample.time.unwrap_or(f64::NAN), joints: readings, seen: &seen, points: &points };
        let tick = servo.tick(world.time(), &now, &limits, scene.dt)?;
        let moment = Moment {
            time: world.time(),
            error_px: tick.error_px,
            error_m,
            joints: world.joints().to_vec(),
            features: world.features(),
            pixels: sample.pixels,
            goal,
            active: tick.active,
            conflict: tick.conflict,
            command: tick.command,
            waits: tick.waits,
        };
        let went_on = watch(&moment).is_continue();
        commands += usize::from(moment.command != Command::Hold);
        world.execute(&moment.command, scene.dt)?;
        moments.push(moment);
        if let Some(stop) = tick.stop {
            return Ok(Run { moments, stop, commands, limits: limit_names, header: world.header().clone() });
        }
        if !went_on {
            return Err(Error::Cancelled);
        }
    }
}

fn sightings(names: &Names, pixels: &[Detection]) -> Vec<Sighting> {
    names.sightings(&Sample { pixels: pixels.to_vec(), ..Sample::default() })
}
