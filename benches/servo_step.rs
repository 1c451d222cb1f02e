//! CPU time of one servo step: 6 joints, 24 image points, joint limits; and how often it asks for memory.
//!
//! `cargo bench --bench servo_step`.
use cpu_time::ThreadTime;
use handeye::infer::Sighting;
use handeye::rig::Rig;
use handeye::servo::limits::InImage;
use handeye::servo::tasks::ImagePoints;
use handeye::servo::{
    Arm, Configuration, Goal, ImageBased, ImageSettings, JointBounds, Limit, LimitRows, MotionSolver, Stepper, Task,
    TaskRows,
};
use handeye::simulate::{SimulateOptions, random_rig, simulate};

#[path = "common/look.rs"]
mod look;

use look::look;

/// Steps that are timed.
const STEPS: usize = 2_000;

/// A situation: how fast joints may move in a step [rad], and how far 6 features must be inside an image [px].
struct Setting {
    name: &'static str,
    speed: f64,
    margin: Option<f64>,
}

const SETTINGS: [Setting; 4] = [
    Setting { name: "no limit active", speed: f64::INFINITY, margin: None },
    Setting { name: "joint speeds active", speed: 0.05, margin: None },
    Setting { name: "and 24 rows of visibility", speed: 0.05, margin: Some(5.0) },
    Setting { name: "of which some cannot hold, through Clarabel", speed: 0.05, margin: Some(200.0) },
];

fn main() {
    println!("{:44} {:>25} {:>25}", "", "rows given", "rows from the rig");
    println!("{:44}{}", "", format!(" {:>9} {:>7} {:>7}", "median µs", "99 % µs", "memory").repeat(2));
    for setting in &SETTINGS {
        let problem = Problem::new(setting);
        let (given, whole) = (problem.rows_given(), problem.whole());
        println!("{:44} {given} {whole}", setting.name);
    }
    println!("{:44} {:>25} {}", "ImageBased, mean matrix, no limit active", "", image_based());
}

struct Problem {
    arm: Arm,
    places: Vec<Vec<f64>>,
    task: ImagePoints,
    image: Option<InImage>,
}

impl Problem {
    fn new(setting: &Setting) -> Self {
        let mut rig = random_rig(6, 2, 12, 3);
        let mut places = positions(&rig, STEPS + 1);
        for joint in &mut rig.robot.joints {
            // Wide enough for whole steps.
            let limits = &mut joint.limits;
            (limits.lower, limits.upper, limits.velocity) = (Some(-50.0), Some(50.0), Some(setting.speed));
        }
        let arm = Arm::new(&rig).expect("complete");
        let mut at = Configuration::default();
        arm.configure(&places.pop().expect("asked for"), &mut at);
        let pairs = (0..2).flat_map(|camera| (0..12).map(move |feature| (camera, feature)));
        let target = |(camera, feature)| {
            let pixel = arm.pixel(&at, camera, feature).expect("of the rig");
            Sighting { camera, feature, pixel }
        };
        let task = ImagePoints { targets: pairs.map(target).collect(), seen: Vec::new(), sd: 1.0 };
        let image = |margin| InImage { camera: 0, features: (0..6).collect(), margin, strength: 10.0 };
        Problem { arm, places, task, image: setting.margin.map(image) }
    }

    /// The motion alone.
    fn rows_given(&self) -> Times {
        let (mut at, mut solver) = (Configuration::default(), MotionSolver::new(1e-3));
        let (mut tasks, mut limits, mut bounds) = ([TaskRows::default()], LimitRows::default(), JointBounds::default());
        Times::of(&self.places, |joints| {
            self.arm.configure(joints, &mut at);
            tasks[0].clear(6);
            self.task.rows(&self.arm, &at, &mut tasks[0]);
            limits.clear(6);
            self.image.iter().for_each(|image| image.rows(&self.arm, &at, 1.0, &mut limits));
            bounds.update(self.arm.limits(), joints, &[0.0; 6], 1.0);
            spent(|| assert!(!solver.solve(&tasks, &limits, &bounds).failed))
        })
    }

    /// From joints to the motion.
    fn whole(&self) -> Times {
        let (mut at, mut stepper) = (Configuration::default(), Stepper::default());
        let goals = [Goal::new(&self.task)];
        let limits: Vec<&dyn Limit> = self.image.iter().map(|image| image as &dyn Limit).collect();
        Times::of(&self.places, |joints| {
            spent(|| {
                self.arm.configure(joints, &mut at);
                assert!(!stepper.step(&self.arm, &at, &goals, &limits, 1.0).failed);
            })
        })
    }
}

/// The same error, measured in place of predicted, with slopes of two configurations.
fn image_based() -> Times {
    let mut rig = random_rig(6, 2, 12, 3);
    let mut places = positions(&rig, STEPS + 1);
    for joint in &mut rig.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (Some(-50.0), Some(50.0));
    }
    let arm = Arm::new(&rig).expect("complete");
    let mut servo = ImageBased::new(&rig, ImageSettings::default()).expect("complete");
    servo.aim(&look(&arm, &places.pop().expect("asked for")));
    Times::of(&places, |joints| {
        let seen = look(&arm, joints);
        spent(|| assert!(!servo.step(&seen, joints, &[], 100.0).expect("the features are seen").failed))
    })
}

/// How often some work asks for memory, and its CPU time [µs].
fn spent(work: impl FnOnce()) -> (u64, f64) {
    let start = ThreadTime::now();
    let asked = allocation_counter::measure(work).count_total;
    (asked, 1e6 * start.elapsed().as_secs_f64())
}

struct Times {
    median: f64,
    slow: f64,
    /// Most that one step asked for, but for the first 100.
    asked: u64,
}

impl Times {
    fn of(places: &[Vec<f64>], mut step: impl FnMut(&[f64]) -> (u64, f64)) -> Self {
        let (asked, mut times): (Vec<u64>, Vec<f64>) = places.iter().map(|joints| step(joints)).unzip();
        times.sort_by(f64::total_cmp);
        let most = asked[100..].iter().copied().max().unwrap_or(0);
        Times { median: times[times.len() / 2], slow: times[times.len() * 99 / 100], asked: most }
    }
}

impl std::fmt::Display for Times {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:>9.1} {:>7.1} {:>7}", self.median, self.slow, self.asked)
    }
}

fn positions(rig: &Rig, samples: usize) -> Vec<Vec<f64>> {
    let truth =
        simulate(rig, &SimulateOptions { samples, seed: 1, ..SimulateOptions::default() }).expect("in view").truth;
    truth.samples.into_iter().filter_map(|sample| sample.joints).collect()
}
