//! A virtual spring: its centre is moved over a table on which the arm presses, until the tool is seen at a target.
use super::scenes::{curve, view};
use crate::Error;
use crate::camera::{CameraModel, PARAMETERS};
use crate::experiments::controlled::{Controlled, servo};
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::rig::{Model, Rig, catalog};
use crate::servo::image_tasks::{Feature, Geometry, ImageTask, Kind, Part, Place, PointToPoint, Seen, Trackers, View};
use crate::servo::uncalibrated::{Exploration, Quantity, Row as Signal, Settings, Update};
use crate::simulate::world::{Spring, SpringArm, Table};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

pub(in crate::experiments) const VIRTUAL_SPRING: Experiment = Experiment {
    name: "virtual-spring",
    about: "an arm presses on a table, and the centre of its virtual spring is servoed without a rig",
    source: "Ramirez 2016, section 4.4.3 and figure 4.7, in words",
    trials: 10,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Friction of the table, by series.
const FRICTION: [(&str, f64); 3] = [("no friction", 0.0), ("friction 0.02", 0.02), ("friction 0.05", 0.05)];

/// K [N/m], how far below the tool the centre is kept [m] (in the thesis 0.2), and what brakes a joint [N m s/rad].
const STIFFNESS: f64 = 200.0;
const BELOW: f64 = 0.2;
const DAMPING: f64 = 2.0;
const TABLE: f64 = 1e6;

/// The arm where it begins [rad], its tool before the last joint's frame, and how far the target is from it on the table [m].
const START: [f64; 4] = [0.0, 1.0, 0.0, 1.8];
const TOOL: f64 = 0.385;
const AWAY: f64 = 0.15;

/// What a unit of the controlled quantities is [m].
const UNIT: f64 = 0.2;

/// Of the trackers [px].
const NOISE: f64 = 0.3;

/// Commands after exploring, and what is shown.
const COMMANDS: usize = 40;
const SHOWN: (usize, usize) = (COMMANDS, 4);

/// An arm on a table, seen by two cameras.
struct Pressing {
    arm: SpringArm,
    centre: Vector3<f64>,
    target: Vector3<f64>,
    task: ImageTask,
    geometry: Geometry,
    random: ChaCha8Rng,
    least_contact: f64,
}

impl Pressing {
    fn new(friction: f64, seed: u64) -> Result<Self, Error> {
        let mut rig: Rig = catalog::rig("wam4")?;
        rig.robot.joints[3].frame = Some(Pose { translation: Vector3::new(0.0, 0.0, TOOL), ..Pose::identity() });
        let tool = Model::new(&rig)?.tip(&START).translation;
        let table = Table { height: tool.z, stiffness: TABLE, friction };
        let spring = Spring { stiffness: [STIFFNESS; 3], damping: DAMPING, table: Some(table) };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let way = random.random_range(0.0..TAU);
        let target = tool + AWAY * Vector3::new(way.cos(), way.sin(), 0.0);
        let middle = 0.5 * (tool + target);
        let mut intrinsics = [0.0; PARAMETERS];
        intrinsics[..4].copy_from_slice(&[800.0, 800.0, 320.0, 240.0]);
        let mut cameras = Vec::new();
        for from in [Vector3::new(0.5, -0.6, 0.6), Vector3::new(0.6, 0.5, 0.7)] {
            let pose = view(&(middle + from), &middle, &-Vector3::z())?;
            cameras.push(View { model: CameraModel::Pinhole, intrinsics, pose, on_hand: false });
        }
        let geometry = Geometry { cameras, points: vec![Vector3::zeros(), target] };
        let features = vec![
            Feature { name: "tool".to_owned(), place: Place::Hand(None) },
            Feature { name: "mark".to_owned(), place: Place::Target(None) },
        ];
        let part = Part { kind: Kind::PointToPoint(PointToPoint { point: 0, to: 1 }), cameras: vec![0, 1] };
        let cameras = vec!["left".to_owned(), "right".to_owned()];
        let trackers = Trackers { pixels: NOISE, ..Trackers::default() };
        let task = ImageTask::new(None, cameras, features, vec![part], trackers)?;
        let mut arm = SpringArm::new(&rig, &START, spring)?;
        // The spring takes hold.
        let centre = tool - BELOW * Vector3::z();
        arm.pull(&tool, &centre, 1.0)?;
        Ok(Pressing { arm, centre, target, task, geometry, random, least_contact: f64::INFINITY })
    }

    fn seen(&mut self) -> Seen {
        let mut seen = self.geometry.see(&self.task, &self.arm.tip());
        for pixel in seen.pixels.iter_mut().flatten() {
            *pixel = pixel.map(|x| x + NOISE * self.random.sample::<f64, _>(StandardNormal));
        }
        seen
    }

    /// Of the tool from the target, along the table [m].
    fn off(&self) -> f64 {
        (self.arm.tip().translation - self.target).xy().norm()
    }
}

impl Controlled for Pressing {
    fn quantities(&self) -> Vec<Quantity> {
        ["x_d", "y_d"].map(|name| Quantity { name: name.to_owned(), ..Quantity::default() }).to_vec()
    }

    fn rows(&mut self) -> Result<Vec<Signal>, Error> {
        let seen = self.seen();
        self.task.signals(&seen)
    }

    fn readings(&self) -> Vec<f64> {
        vec![self.centre.x / UNIT, self.centre.y / UNIT]
    }

    fn errors(&mut self) -> Vec<f64> {
        let seen = self.seen();
        self.task.values(&seen)
    }

    fn carry_out(&mut self, motion: &[f64]) -> Result<(), Error> {
        let there = self.centre + UNIT * Vector3::new(motion[0], motion[1], 0.0);
        // The centre is kept below the tool, which presses with the same force wherever it is.
        let there = Vector3::new(there.x, there.y, self.arm.tip().translation.z - BELOW);
        self.arm.pull(&self.centre, &there, 1.0)?;
        self.centre = there;
        self.least_contact = self.least_contact.min(self.arm.contact());
        Ok(())
    }
}

/// After every command since exploring: mean error of the rows [px], distance [mm], force of contact [N]; and the least force of all commands, and
/// whether it was stopped.
struct Pressed {
    curves: [Vec<Option<f64>>; 3],
    least_contact: f64,
    stopped: bool,
}

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, |seed| {
        FRICTION.iter().map(|(_, friction)| press(*friction, seed)).collect::<Result<Vec<_>, _>>()
    })?;
    let (mut rows, mut ends, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for (index, (series, _)) in FRICTION.iter().enumerate() {
        for (figure, panel) in
            ["image error [px]", "tool from target [mm]", "force of contact [N]"].into_iter().enumerate()
        {
            let trials: Vec<Vec<Option<f64>>> = results.iter().map(|runs| runs[index].curves[figure].clone()).collect();
            rows.extend(curve(panel, series, &trials, SHOWN));
        }
        let least: Vec<Option<f64>> = results.iter().map(|runs| Some(runs[index].least_contact)).collect();
        ends.push(Row::new(format!("least force of contact, exploring included, {series}, N"), None, &least));
        let stopped = results.iter().filter(|runs| runs[index].stopped).count();
        notes.push(format!("{series}: {stopped} of {} were stopped before the end", results.len()));
    }
    rows.extend(ends);
    notes.push(format!(
        "at rest the tool presses with K times {BELOW} m: {} N; friction then holds it where the centre is within {} mm of it",
        STIFFNESS * BELOW,
        // Coulomb's μ K below = K off.
        FRICTION.map(|(_, friction)| format!("{:.0}", 1e3 * friction * BELOW)).join(", ")
    ));
    notes.push("published in words: contacts between a solid table and the robot could safely be made".to_owned());
    Ok(Outcome {
        setting: format!(
            "WAM of 4 joints, K = {STIFFNESS} N/m, the spring's centre kept {BELOW} m below the tool and servoed along the table to a mark {AWAY} m \
             away, 2 cameras, {NOISE} px; the Jacobian is kept as explored; a trial is a direction of the mark"
        ),
        measure: "mean absolute error of the rows [px], distance [mm], force [N]",
        abscissa: Some("commands after exploring"),
        rows,
        notes,
    })
}

fn press(friction: f64, seed: u64) -> Result<Pressed, Error> {
    let mut world = Pressing::new(friction, seed)?;
    // Motions that friction does not swallow.
    let exploration = Exploration { size: 0.4, largest: 0.5, ..Exploration::default() };
    // What sticks and slips teaches nothing of the slopes.
    let settings = Settings { exploration, update: Update::Keep, ..Settings::default() };
    let mut curves: [Vec<Option<f64>>; 3] = Default::default();
    let found = servo(&mut world, &settings, COMMANDS, &mut |world, _| {
        curves[1].push(Some(1e3 * world.off()));
        curves[2].push(Some(world.arm.contact()));
    })?;
    // Four rows, of which the sum of the absolute errors is known.
    curves[0] = found.errors.iter().map(|sum| Some(sum / 4.0)).collect();
    Ok(Pressed { curves, least_contact: world.least_contact, stopped: found.stop.is_some() })
}
