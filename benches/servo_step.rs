//! CPU time of one servo step: 6 joints, 24 image points, joint limits; and how often it asks for memory.
//!
//! `cargo bench --bench servo_step`.
use cpu_time::ThreadTime;
use handeye::infer::Sighting;
use handeye::rig::Rig;
use handeye::servo::limits::InImage;
use handeye::servo::tasks::ImagePoints;
use handeye::servo::{Arm, Configuration, Goal, ImageBased, ImageSettings, Limit, Stepper};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts what is asked for.
struct Counting;

static ASKED: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator as it is.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ASKED.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Steps that are timed.
const STEPS: usize = 2_000;

fn main() {
    println!("{:44} {:>10} {:>8} {:>9} {:>12}", "", "median µs", "99 % µs", "required", "allocations");
    row("no limit active", f64::INFINITY, false, "3");
    row("joint speeds active, through Clarabel", 0.05, false, "35");
    row("and 24 rows of visibility, through Clarabel", 0.05, true, "120");
    image_based("ImageBased, mean matrix, no limit active");
}

fn row(name: &str, speed: f64, visible: bool, required: &str) {
    let mut rig = random_rig(6, 2, 12, 3);
    let places = positions(&rig, STEPS + 1);
    for joint in &mut rig.robot.joints {
        // Wide enough for whole steps.
        (joint.limits.lower, joint.limits.upper, joint.limits.velocity) = (Some(-50.0), Some(50.0), Some(speed));
    }
    let arm = Arm::new(&rig).expect("complete");
    let mut at = Configuration::default();
    arm.configure(&places[STEPS], &mut at);
    let pairs = (0..2).flat_map(|camera| (0..12).map(move |feature| (camera, feature)));
    let target =
        |(camera, feature)| Sighting { camera, feature, pixel: arm.pixel(&at, camera, feature).expect("of the rig") };
    let task = ImagePoints { targets: pairs.map(target).collect(), seen: Vec::new(), sd: 1.0 };
    let image = InImage { camera: 0, features: (0..6).collect(), margin: 5.0, strength: 10.0 };
    let limits: &[&dyn Limit] = if visible { &[&image] } else { &[] };
    let goals = [Goal::new(&task)];
    let mut stepper = Stepper::default();
    timed(name, required, |index| {
        arm.configure(&places[index], &mut at);
        assert!(!stepper.step(&arm, &at, &goals, limits, 1.0).failed);
    });
}

/// The same error, measured in place of predicted, with slopes of two configurations.
fn image_based(name: &str) {
    let mut rig = random_rig(6, 2, 12, 3);
    let places = positions(&rig, STEPS + 1);
    for joint in &mut rig.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (Some(-50.0), Some(50.0));
    }
    let arm = Arm::new(&rig).expect("complete");
    let look = |joints: &[f64]| -> Vec<Sighting> {
        let mut at = Configuration::default();
        arm.configure(joints, &mut at);
        let pairs = (0..2).flat_map(|camera| (0..12).map(move |feature| (camera, feature)));
        let see = |(camera, feature)| Some(Sighting { camera, feature, pixel: arm.pixel(&at, camera, feature)? });
        pairs.filter_map(see).collect()
    };
    let seen: Vec<Vec<Sighting>> = places.iter().map(|joints| look(joints)).collect();
    let mut servo = ImageBased::new(&rig, ImageSettings::default()).expect("complete");
    servo.aim(&seen[STEPS]);
    timed(name, "-", |index| {
        let step = servo.step(&seen[index], &places[index], &[], 100.0).expect("the features are seen");
        assert!(!step.failed);
    });
}

fn timed(name: &str, required: &str, mut step: impl FnMut(usize)) {
    let (mut times, mut asked) = (Vec::new(), 0);
    for index in 0..STEPS {
        let before = (ASKED.load(Ordering::Relaxed), ThreadTime::now());
        step(index);
        let (elapsed, now) = (before.1.elapsed(), ASKED.load(Ordering::Relaxed));
        // All but the first few.
        asked = asked.max(if times.len() > 10 { now - before.0 } else { 0 });
        times.push(1e6 * elapsed.as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    println!("{name:44} {:>10.1} {:>8.1} {required:>9} {asked:>12}", times[STEPS / 2], times[STEPS * 99 / 100]);
}

fn positions(rig: &Rig, samples: usize) -> Vec<Vec<f64>> {
    let truth =
        simulate(rig, &SimulateOptions { samples, seed: 1, ..SimulateOptions::default() }).expect("in view").truth;
    truth.samples.into_iter().filter_map(|sample| sample.joints).collect()
}
