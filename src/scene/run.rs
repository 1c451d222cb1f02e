//! Running a scene.
use super::place::Setting;
use super::{Control, LimitKind, Scene, UncalibratedControl};
use crate::Error;
use crate::infer::{Names, Sighting};
use crate::recording::{Detection, Recording, Sample};
use crate::rig::{Parent, Rig};
use crate::servo::limits::{HalfSpace, InImage, PixelSpeed, TipBox, TipSpeed, VirtualFixture};
use crate::servo::{
    Active, Command, Constraint, Controller, ImageBased, Limit, Measurement, ModelBased, ModelBasedTip, PoseBased,
    ServoLoop, Stop, Takes, UncalibratedJoints, UncalibratedTask,
};
use handeye_solvers::Pose;
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
    check(truth, known, scene)?;
    let is_fine = matches!(control, Control::Uncalibrated(UncalibratedControl { hybrid: false, .. }));
    if scene.task.is_some() && !is_fine {
        let name = control.name();
        return Err(Error::Unusable(format!(
            "a task is carried out by a controller of kind uncalibrated, this is {name}"
        )));
    }
    // What does not fit is said of the world before it is of the controller.
    let setting = Setting::new(scene, truth, known)?;
    run_in(setting, scene.controller(&control, learned, known)?, known, scene, watch)
}

fn needs_rig(controller: &str) -> Error {
    Error::Unusable(format!(
        "a controller of kind {controller} needs a rig that it knows, and none is given: give LEARNED, or `kind = \"uncalibrated\"`"
    ))
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

/// That a scene fits its true rig and the one that is known, that nothing in it is without effect, and that it ends.
fn check(truth: &Rig, known: &Rig, scene: &Scene) -> Result<(), Error> {
    let n = truth.robot.joints.len();
    let lists = [
        ("start", scene.start.len()),
        ("target.joints", scene.target.joints.len()),
        ("target.velocity", if scene.target.velocity.is_empty() { n } else { scene.target.velocity.len() }),
    ];
    for (name, found) in lists {
        if found != n {
            return Err(Error::Unusable(format!("`{name}` of the scene has {found} numbers, the rig has {n} joints")));
        }
    }
    let images = scene.limits.iter().find(|(_, kind)| matches!(kind, LimitKind::InImage(_)));
    if let (Some((limit, _)), Some(camera)) = (images, known.cameras.iter().find(|camera| camera.size.is_none())) {
        return Err(Error::Unusable(format!(
            "limit `{limit}`: camera `{}` of the known rig has no `size`, so nothing says where its images end",
            camera.name
        )));
    }
    if let (Some(_), Some((limit, _))) = (&scene.task, scene.limits.first()) {
        return Err(Error::Unusable(format!("limit `{limit}` needs a rig, and a task is carried out without one")));
    }
    let execution = &scene.world.execution;
    let moves_tip = matches!(scene.takes, Takes::PoseDelta | Takes::PoseVelocity);
    let without_effect = [
        ("`pose` of the scene's `execution`", execution.pose.is_noisy() && !moves_tip),
        ("`joints` of the scene's `execution`", execution.joints > 0.0 && moves_tip),
        ("`dead_band` of the scene's `execution`", execution.dead_band > 0.0 && moves_tip),
        ("`gain` of the scene's `execution`", !execution.gain.is_empty() && moves_tip),
        ("`couplings` of the scene's robot", !scene.couplings.is_empty() && moves_tip),
    ];
    if let Some((what, _)) = without_effect.iter().find(|(_, is_idle)| *is_idle) {
        let takes = scene.takes.name();
        return Err(Error::Unusable(format!("{what} has no effect on a robot that takes {takes}")));
    }
    let (timeout, dt) = (scene.settings.timeout, scene.dt);
    if !(dt > 0.0 && dt.is_finite()) {
        return Err(Error::Unusable(format!("a scene cannot go on in steps of {dt} s")));
    }
    let ticks = timeout / dt;
    if ticks > MOST_TICKS {
        return Err(Error::Unusable(format!(
            "a loop of {timeout} s in steps of {dt} s would have {ticks:.0} steps, at most {MOST_TICKS} are run"
        )));
    }
    Ok(())
}

/// More steps than anybody wants to see.
const MOST_TICKS: f64 = 1e6;

/// Strength of a scene's limits against each other.
const STRENGTH: f64 = 10.0;

impl Scene {
    /// The controller. `learned`: the rig that it knows; `known`: whose joints it moves.
    ///
    /// Errors: [`Error::Unusable`] where it needs a rig, or does not suit what the robot takes; those of its making.
    fn controller(&self, control: &Control, learned: Option<&Rig>, known: &Rig) -> Result<Box<dyn Controller>, Error> {
        let (takes, name) = (self.takes, control.name());
        let moves_tip = matches!(takes, Takes::PoseDelta | Takes::PoseVelocity);
        let rig = || learned.ok_or_else(|| needs_rig(name));
        Ok(match control {
            Control::ModelBased => {
                let mut controller = ModelBased::new(rig()?)?;
                controller.takes = takes;
                Box::new(controller)
            }
            Control::ModelBasedTip { speed } => {
                let mut controller = ModelBasedTip::new(rig()?)?;
                (controller.takes, controller.speed) = (takes, *speed);
                if !moves_tip {
                    return Err(Error::Unusable(format!(
                        "a controller that moves the tip needs a robot that takes pose-deltas or pose-velocities, this takes {}",
                        takes.name()
                    )));
                }
                Box::new(controller)
            }
            Control::ImageBased(settings) => {
                let mut controller = ImageBased::new(rig()?, settings.clone())?;
                controller.takes = takes;
                Box::new(controller)
            }
            Control::PoseBased(settings) => {
                let mut controller = PoseBased::new(rig()?, settings.clone())?;
                controller.takes = takes;
                Box::new(controller)
            }
            Control::Uncalibrated(control) if self.task.is_some() => {
                let Some(task) = self.task.clone() else { return Err(needs_rig(name)) };
                let truth = self.rig.as_ref().unwrap_or(known);
                let mut controller = UncalibratedTask::new(task, takes, &truth.robot.joints, control.settings.clone())?;
                controller.dead_band(control.dead_band)?;
                // What anybody sees who looks at the robot.
                let is_carried = |name: &String| {
                    truth.cameras.iter().any(|camera| camera.name == *name && camera.parent != Parent::World)
                };
                let cameras = self.task.iter().flat_map(|task| task.cameras());
                controller.carried = cameras.map(is_carried).collect();
                Box::new(controller)
            }
            Control::Uncalibrated(_) if moves_tip => {
                return Err(Error::Unusable(format!(
                    "a controller of kind {name} moves joints, this robot takes {}",
                    takes.name()
                )));
            }
            Control::Uncalibrated(UncalibratedControl { pixels, settings, dead_band, hybrid }) => {
                let settings = settings.clone();
                let mut controller = if *hybrid {
                    UncalibratedJoints::with_rig(rig()?, *pixels, settings)?
                } else {
                    UncalibratedJoints::new(&known.robot.joints, *pixels, settings)?
                };
                controller.takes = takes;
                controller.dead_bands(&vec![*dead_band; known.robot.joints.len()])?;
                Box::new(controller)
            }
        })
    }

    /// The limits for a rig, one by one, with their names.
    fn limits(&self, known: &Rig) -> Vec<(String, Box<dyn Limit>)> {
        let features: Vec<usize> = (0..known.features.len()).collect();
        let mut limits: Vec<(String, Box<dyn Limit>)> = Vec::new();
        for (name, kind) in &self.limits {
            let cameras = 0..known.cameras.len();
            let mut add = |limit: Box<dyn Limit>| limits.push((name.clone(), limit));
            match *kind {
                LimitKind::InImage(margin) => cameras.for_each(|camera| {
                    add(Box::new(InImage { camera, features: features.clone(), margin, strength: STRENGTH }));
                }),
                LimitKind::PixelSpeed(speed) => cameras.for_each(|camera| {
                    add(Box::new(PixelSpeed { camera, features: features.clone(), speed, strength: STRENGTH }));
                }),
                LimitKind::TipSpeed(speed) => add(Box::new(TipSpeed { speed, strength: STRENGTH })),
                LimitKind::HalfSpace(normal, offset) => add(Box::new(HalfSpace { normal, offset, strength: STRENGTH })),
                LimitKind::TipBox(low, high) => {
                    add(Box::new(TipBox { frame: Pose::identity(), low, high, strength: STRENGTH }));
                }
                LimitKind::Follow(guide, tolerance) => {
                    add(Box::new(VirtualFixture { guide, tolerance, strength: STRENGTH }));
                }
            }
        }
        limits
    }
}
