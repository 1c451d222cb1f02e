//! What Python costs: CPU time of the same work from Rust and through the wheel, in turns; of each the least, to which others on the
//! machine only add.
//!
//! `python -m venv /tmp/venv && /tmp/venv/bin/pip install ./python && PYTHON=/tmp/venv/bin/python cargo bench --bench python`.
use cpu_time::{ProcessTime, ThreadTime};
use handeye::calibrate::{Options, calibrate};
use handeye::infer::Sighting;
use handeye::rig::Rig;
use handeye::servo::tasks::ImagePoints;
use handeye::servo::{Arm, Configuration, Controller, Goal, ImageBased, ImageSettings, Measurement, Stepper};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::io::{BufRead, BufReader, Write};
use std::ops::ControlFlow;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

#[path = "common/look.rs"]
mod look;

use look::look;

/// Rigs that are learned, times that each is, and rounds of 2,000 steps.
const RIGS: u64 = 7;
const REPEATS: usize = 10;
const ROUNDS: usize = 30;

fn main() {
    let mut python = Python::start();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    println!("{:44} {:>10} {:>10} {:>10}", "", "Rust", "Python", "");
    let (mut ours, mut theirs, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 1..=RIGS {
        let (mut rust, mut other) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..REPEATS {
            rust = rust.min(pool.install(|| seconds_to_learn(seed)));
            other = other.min(python.ask(&format!("calibrate {seed}")));
        }
        ours.push(1e3 * rust);
        theirs.push(1e3 * other);
        ratios.push(other / rust);
    }
    println!(
        "{:44} {:>7.1} ms {:>7.1} ms {:>9.3}x",
        "calibrate, one thread",
        median(&mut ours),
        median(&mut theirs),
        median(&mut ratios)
    );
    let mut steps = Steps::new();
    for (name, work) in [("step", Steps::step as fn(&mut Steps) -> f64), ("image_based", Steps::image_based)] {
        let (mut rust, mut other) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            rust = rust.min(1e6 * work(&mut steps));
            other = other.min(1e6 * python.ask(name));
        }
        println!(
            "{:44} {rust:>7.2} µs {other:>7.2} µs {:>+8.2} µs",
            format!("{name}, 6 joints, 24 points"),
            other - rust
        );
    }
}

fn seconds_to_learn(seed: u64) -> f64 {
    let rig = random_rig(6, 2, 12, seed);
    let motions = simulate(&rig, &SimulateOptions::default()).expect("in view").recording;
    let start = ProcessTime::now();
    let learned = calibrate(&Rig::default(), &motions, &Options::default(), &mut |_| ControlFlow::Continue(()));
    let seconds = start.elapsed().as_secs_f64();
    assert!(learned.expect("learned").report.converged);
    seconds
}

/// The steps of `benches/python.py`.
struct Steps {
    arm: Arm,
    at: Configuration,
    places: Vec<Vec<f64>>,
    seen: Vec<Vec<Sighting>>,
    task: ImagePoints,
    stepper: Stepper,
    controller: ImageBased,
}

impl Steps {
    fn new() -> Self {
        let mut rig = random_rig(6, 2, 12, 3);
        let options = SimulateOptions { samples: 2001, ..SimulateOptions::default() };
        let truth = simulate(&rig, &options).expect("in view").truth;
        let mut places: Vec<Vec<f64>> = truth.samples.into_iter().filter_map(|sample| sample.joints).collect();
        for joint in &mut rig.robot.joints {
            let limits = &mut joint.limits;
            (limits.lower, limits.upper, limits.velocity) = (Some(-50.0), Some(50.0), None);
        }
        let arm = Arm::new(&rig).expect("complete");
        let goal = look(&arm, &places.pop().expect("asked for"));
        let seen = places.iter().map(|joints| look(&arm, joints)).collect();
        let mut controller = ImageBased::new(&rig, ImageSettings::default()).expect("complete");
        controller.aim(&goal);
        let task = ImagePoints { targets: goal, seen: Vec::new(), sd: 1.0 };
        Steps { arm, at: Configuration::default(), places, seen, task, stepper: Stepper::default(), controller }
    }

    fn step(&mut self) -> f64 {
        let Steps { arm, at, places, task, stepper, .. } = self;
        let goals = [Goal::new(task)];
        let start = ThreadTime::now();
        for joints in &*places {
            arm.configure(joints, at);
            assert!(!stepper.step(arm, at, &goals, &[], 1.0).failed);
        }
        start.elapsed().as_secs_f64() / places.len() as f64
    }

    fn image_based(&mut self) -> f64 {
        let start = ThreadTime::now();
        for (joints, seen) in self.places.iter().zip(&self.seen) {
            let now = Measurement { time: 0.0, joints, seen, points: &[] };
            assert!(self.controller.decide(&now, &[], 100.0).is_ok());
        }
        start.elapsed().as_secs_f64() / self.places.len() as f64
    }
}

struct Python {
    child: Child,
    questions: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Python {
    fn start() -> Self {
        let interpreter = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/python.py");
        let mut command = Command::new(interpreter);
        let mut child =
            command.arg(script).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("PYTHON runs Python");
        let (questions, answers) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
        Python { child, questions, answers: BufReader::new(answers) }
    }

    fn ask(&mut self, what: &str) -> f64 {
        writeln!(self.questions, "{what}").expect("Python listens");
        let mut answer = String::new();
        self.answers.read_line(&mut answer).expect("Python answers");
        answer.trim().parse().expect("seconds; is handeye installed there?")
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        // It ends by itself where the questions end; the bench does not wait for it.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
