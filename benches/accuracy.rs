//! How often a rig is learned from nothing, and how well: held-out error over the floor of the noise, 100 seeds each.
//!
//! `cargo bench --bench accuracy -- [--seeds N] [SETTING]...`
use handeye::calibrate::{Options, calibrate, evaluate};
use handeye::recording::RecordedCamera;
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::ops::ControlFlow;

#[path = "common/variants.rs"]
mod variants;

/// One row of the table: a rig per seed, what is recorded of it, and the bar.
struct Setting {
    name: &'static str,
    rig: fn(u64) -> Rig,
    samples: usize,
    missed: f64,
    outliers: f64,
    /// Whether the recording's header is silent on intrinsics.
    guess: bool,
    /// Whether depth cameras give points alone.
    points_alone: bool,
    /// What is known of the true rig.
    known: fn(&Rig) -> Rig,
    /// Held-out rms over the floor, and how many of 100 seeds must be within it.
    bar: (f64, usize),
}

const PLAIN: Setting = Setting {
    name: "six",
    rig: |seed| random_rig(6, 2, 12, seed),
    samples: 50,
    missed: 0.0,
    outliers: 0.0,
    guess: false,
    points_alone: false,
    known: variants::forgotten,
    bar: (1.05, 99),
};

const SETTINGS: [Setting; 23] = [
    Setting { name: "six50", ..PLAIN },
    Setting { name: "six30", samples: 30, bar: (1.10, 95), ..PLAIN },
    Setting { name: "seven", rig: |seed| random_rig(7, 3, 12, seed), samples: 80, missed: 1.0 / 3.0, ..PLAIN },
    Setting { name: "one", rig: |seed| random_rig(6, 1, 12, seed), samples: 80, bar: (1.05, 90), ..PLAIN },
    Setting { name: "ur5", rig: variants::ur5, ..PLAIN },
    Setting { name: "ur5-30", rig: variants::ur5, samples: 30, bar: (1.10, 95), ..PLAIN },
    Setting { name: "outliers", outliers: 0.05, ..PLAIN },
    Setting { name: "ur5-outliers", rig: variants::ur5, outliers: 0.05, ..PLAIN },
    Setting { name: "guessed", guess: true, ..PLAIN },
    Setting { name: "planar", rig: |seed| variants::planar(2, seed), ..PLAIN },
    Setting { name: "planar-one", rig: |seed| variants::planar(1, seed), samples: 80, bar: (1.05, 90), ..PLAIN },
    Setting { name: "modified", rig: variants::modified, ..PLAIN },
    Setting { name: "prismatic", rig: variants::prismatic, ..PLAIN },
    Setting { name: "hand", rig: |seed| variants::on_hand(1, seed), samples: 80, bar: (1.05, 90), ..PLAIN },
    Setting { name: "hand-two", rig: |seed| variants::on_hand(2, seed), ..PLAIN },
    Setting { name: "links", rig: variants::on_links, ..PLAIN },
    Setting { name: "cameras-held", known: variants::cameras_held, ..PLAIN },
    Setting { name: "twists-held", known: variants::twists_held, ..PLAIN },
    Setting { name: "nominal", rig: variants::ur5, known: variants::nominal, ..PLAIN },
    Setting { name: "structure", known: variants::structure, ..PLAIN },
    Setting { name: "depth", rig: |seed| variants::depth(1, seed), points_alone: true, bar: (1.05, 95), ..PLAIN },
    Setting {
        name: "depth-colour",
        rig: |seed| variants::depth(2, seed),
        points_alone: true,
        bar: (1.05, 95),
        ..PLAIN
    },
    Setting { name: "rgbd", rig: |seed| variants::depth(1, seed), bar: (1.05, 95), ..PLAIN },
];

fn main() {
    let mut names = Vec::new();
    let (mut seeds, mut only, mut verbose) = (100, None, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--seeds" => seeds = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(seeds),
            "--seed" => only = arguments.next().and_then(|n| n.parse::<u64>().ok()),
            "--verbose" => verbose = true,
            "--bench" => {}
            name => names.push(name.to_owned()),
        }
    }
    println!("{:14} {:>8} {:>8} {:>8} {:>8}  within  bar", "setting", "median", "90 %", "largest", "s/rig");
    for setting in SETTINGS.iter().filter(|setting| names.is_empty() || names.iter().any(|name| name == setting.name)) {
        let mut ratios = Vec::new();
        let range = only.map_or(0..seeds, |seed| seed..seed + 1);
        let started = std::time::Instant::now();
        for seed in range.clone() {
            let ratio = run(setting, seed, verbose);
            if verbose || ratio > setting.bar.0 {
                println!("    seed {seed}: {ratio:.3}");
            }
            ratios.push(ratio);
        }
        let seconds = started.elapsed().as_secs_f64() / ratios.len() as f64;
        let within = ratios.iter().filter(|ratio| **ratio <= setting.bar.0).count();
        ratios.sort_by(f64::total_cmp);
        let n = ratios.len();
        println!(
            "{:14} {:8.3} {:8.3} {:8.3} {:8.3}  {within} of {n} within {}, wanted {} of 100",
            setting.name,
            ratios[n / 2],
            ratios[(9 * n / 10).min(n - 1)],
            ratios[n - 1],
            seconds,
            setting.bar.0,
            setting.bar.1,
        );
    }
}

/// Held-out rms over the floor, of pixels or of points where these are further above theirs; infinite where nothing was learned.
fn run(setting: &Setting, seed: u64, verbose: bool) -> f64 {
    let truth = (setting.rig)(seed);
    let record = |samples, seed, missed, outliers| {
        let options = SimulateOptions { samples, seed, missed, outliers, ..Default::default() };
        simulate(&truth, &options).expect("the rig is complete and in view").recording
    };
    let mut training = record(setting.samples, 2 * seed, setting.missed, setting.outliers);
    let mut fresh = record(100, 2 * seed + 1, 0.0, 0.0);
    if setting.points_alone {
        variants::points_alone(&truth, &mut training);
        variants::points_alone(&truth, &mut fresh);
    }
    let forgotten = (setting.known)(&truth);
    if setting.guess {
        for camera in &mut training.cameras {
            *camera = RecordedCamera { name: camera.name.clone(), size: camera.size, ..RecordedCamera::default() };
        }
    }
    match calibrate(&forgotten, &training, &Options::default(), &mut |_| ControlFlow::Continue(())) {
        Ok(learned) => {
            if verbose {
                println!("{:#?}", learned.report.stages);
                println!("{:?} {:?}", learned.report.gauge, learned.report.findings);
                println!("training rms {}", learned.report.rms_px);
            }
            let evaluation = evaluate(&learned.rig, &fresh).expect("the learned rig is complete");
            let of_pixels = evaluation.total.rms_px / (truth.noise.pixels * 2.0_f64.sqrt());
            let of_points = evaluation.total.points.rms_m / (truth.noise.points * 3.0_f64.sqrt());
            of_pixels.max(of_points)
        }
        Err(error) => {
            println!("    seed {seed}: {error}");
            f64::INFINITY
        }
    }
}
