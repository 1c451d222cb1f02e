//! A drone over a line: a pilot flies it, and its yaw is servoed without a rig to keep the line upright in its image.
use super::scenes::curve;
use crate::Error;
use crate::experiments::controlled::{Controlled, servo};
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::servo::image_tasks::{Feature, ImageTask, Kind, LineAngle, Part, Place, Seen, Trackers};
use crate::servo::uncalibrated::{Exploration, Quantity, Row as Signal, Settings};
use crate::simulate::world::Drone;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

pub(in crate::experiments) const DRONE: Experiment = Experiment {
    name: "drone",
    about: "a drone's yaw is servoed without a rig along a line on the ground, while a pilot flies it",
    source: "Ramirez 2016, section 4.4.5 and figure 4.9, in words",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// How it is flown: from side to side and up and down by so much [m], and how fast wind turns it [rad per command].
const FLIGHTS: [(&str, [f64; 2], f64); 3] = [
    ("hovering", [0.0, 0.0], 0.0),
    ("flown by a pilot", [0.4, 0.3], 0.0),
    ("flown, turned by wind", [0.4, 0.3], PI / 180.0),
];

/// How far it begins turned [rad], at least and at most.
const TURNED: [f64; 2] = [20.0 * PI / 180.0, 70.0 * PI / 180.0];

/// Height [m]; commands per swing of the pilot; seconds per command.
const HEIGHT: f64 = 1.5;
const SWING: f64 = 25.0;
const DT: f64 = 0.2;

/// Of the ends of the line that the tracker sees [px], of a turn as a share of it, and of the autopilot's heading after each [rad].
const NOISE: f64 = 1.0;
const SHARE: f64 = 0.05;
const HEADING: f64 = 0.2 * PI / 180.0;

/// Commands after exploring, and what is shown.
const COMMANDS: usize = 60;
const SHOWN: (usize, usize) = (COMMANDS, 5);

/// Commands at the end that tell what is left.
const LAST: usize = 20;

/// g [m/s²]: a drone leans to where it accelerates.
const GRAVITY: f64 = 9.81;

struct Flight {
    drone: Drone,
    swing: [f64; 2],
    wind: f64,
    phase: f64,
    time: f64,
    task: ImageTask,
    random: ChaCha8Rng,
}

impl Flight {
    fn new((swing, wind): ([f64; 2], f64), seed: u64) -> Result<Self, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let yaw = side * random.random_range(TURNED[0]..TURNED[1]);
        let phase = random.random_range(0.0..TAU);
        let features = ["ahead", "behind"].map(|name| Feature { name: name.to_owned(), place: Place::Target(None) });
        let part = Part {
            kind: Kind::LineAngle(LineAngle { line: [0, 1], angle: FRAC_PI_2, directed: false }),
            cameras: vec![0],
        };
        let trackers = Trackers { pixels: NOISE, ..Trackers::default() };
        let task = ImageTask::new(None, vec!["below".to_owned()], features.to_vec(), vec![part], trackers)?;
        let drone = Drone { position: Vector3::new(0.0, 0.0, HEIGHT), yaw, lean: [0.0; 2] };
        let mut flight = Flight { drone, swing, wind: side * wind, phase, time: 0.0, task, random };
        flight.fly();
        Ok(flight)
    }

    /// What the pilot does: the drone goes on along the line, from side to side and up and down, and leans as it must.
    fn fly(&mut self) {
        let rate = TAU / SWING;
        let angle = self.phase + rate * self.time;
        let sideways = self.swing[0] * angle.sin();
        let acceleration = -self.swing[0] * (rate / DT).powi(2) * angle.sin();
        self.drone.position = Vector3::new(0.1 * self.time, sideways, HEIGHT + self.swing[1] * (0.7 * angle).sin());
        // In the drone's own directions.
        let (sin, cos) = self.drone.yaw.sin_cos();
        self.drone.lean = [acceleration * sin / GRAVITY, -acceleration * cos / GRAVITY];
    }

    fn seen(&mut self) -> Seen {
        let mut seen = Seen::new(&self.task);
        if let Some(ends) = self.drone.line() {
            for (place, end) in seen.pixels[0].iter_mut().zip(ends) {
                *place = end.map(|x| x + NOISE * self.random.sample::<f64, _>(StandardNormal));
            }
        }
        seen
    }

    /// Of the nose from the line, whichever way along it [degrees].
    fn off(&self) -> f64 {
        self.drone.yaw.sin().atan2(self.drone.yaw.cos().abs()).abs().to_degrees()
    }
}

impl Controlled for Flight {
    fn quantities(&self) -> Vec<Quantity> {
        vec![Quantity { name: "yaw".to_owned(), ..Quantity::default() }]
    }

    fn rows(&mut self) -> Result<Vec<Signal>, Error> {
        let seen = self.seen();
        self.task.signals(&seen)
    }

    /// The compass, which shows what wind does too.
    fn readings(&self) -> Vec<f64> {
        vec![self.drone.yaw]
    }

    fn errors(&mut self) -> Vec<f64> {
        let seen = self.seen();
        self.task.values(&seen)
    }

    fn carry_out(&mut self, motion: &[f64]) -> Result<(), Error> {
        let mut normal = || self.random.sample::<f64, _>(StandardNormal);
        let turn = motion[0] * (1.0 + SHARE * normal()) + HEADING * normal();
        self.drone.yaw += turn + self.wind;
        self.time += 1.0;
        self.fly();
        Ok(())
    }
}

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, |seed| {
        let fly = |(_, swing, wind): &(&str, [f64; 2], f64)| trial((*swing, *wind), seed);
        FLIGHTS.iter().map(fly).collect::<Result<Vec<_>, _>>()
    })?;
    let (mut rows, mut ends, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for (index, (series, ..)) in FLIGHTS.iter().enumerate() {
        for (figure, panel) in ["line off the vertical [px]", "nose off the line [degrees]"].into_iter().enumerate() {
            let trials: Vec<Vec<Option<f64>>> = results.iter().map(|runs| runs[index].0[figure].clone()).collect();
            rows.extend(curve(panel, series, &trials, SHOWN));
        }
        let settled: Vec<Option<f64>> = results
            .iter()
            .map(|runs| {
                let last: Vec<f64> = runs[index].0[1].iter().rev().take(LAST).flatten().copied().collect();
                Some((last.iter().map(|off| off * off).sum::<f64>() / last.len().max(1) as f64).sqrt())
            })
            .collect();
        ends.push(Row::new(format!("nose off the line, last {LAST} commands, {series}, degrees"), None, &settled));
        let stopped = results.iter().filter(|runs| runs[index].1).count();
        notes.push(format!("{series}: {stopped} of {} were stopped before the end", results.len()));
    }
    rows.extend(ends);
    let (gain, wind) = (Settings::default().gain, FLIGHTS[2].2.to_degrees());
    notes.push(format!(
        "with gain {gain}, wind of {wind:.1} degrees per command leaves 1/{gain} of that, {:.1} degrees",
        wind / gain
    ));
    notes.push("published in words: the pilot takes roll, pitch and elevation, servoing the yaw".to_owned());
    Ok(Outcome {
        setting: format!(
            "a drone {HEIGHT} m above a line, its camera down, {NOISE} px at two points of the line, a compass; turns err by {} %; our defaults but \
             for larger exploratory motions; a trial is a start turned by {:.0} to {:.0} degrees",
            100.0 * SHARE,
            TURNED[0].to_degrees(),
            TURNED[1].to_degrees()
        ),
        measure: "error of the line [px], angle between nose and line [degrees]",
        abscissa: Some("commands after exploring"),
        rows,
        notes,
    })
}

/// Errors after every command [px, degrees], and whether it was stopped.
type Flown = ([Vec<Option<f64>>; 2], bool);

fn trial(flight: ([f64; 2], f64), seed: u64) -> Result<Flown, Error> {
    let mut world = Flight::new(flight, seed)?;
    let mut off = Vec::new();
    // Motions that stand out against what the pilot and the wind do meanwhile.
    let exploration = Exploration { size: 0.15, largest: 0.3, ..Exploration::default() };
    let settings = Settings { exploration, ..Settings::default() };
    let found = servo(&mut world, &settings, COMMANDS, &mut |world, _| off.push(Some(world.off())))?;
    Ok(([found.errors.iter().copied().map(Some).collect(), off], found.stop.is_some()))
}
