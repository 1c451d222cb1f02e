//! Image-based and pose-based servoing on the problems that ViSP was measured on, by interaction matrix and gain.
//!
//! `cargo bench --bench servo_visual`. Mean pixel error after each command; the median number of commands to under 1 px; how many of the
//! 100 are within 0.5 px at the end; and the mean with 0.02 rad on joint readings and on actions, three times over as with ViSP,
//! from the eleventh command on, whose floor `cargo bench --bench servo` prints: the target plus one noisy motion.
use handeye::servo::{Controller, Gain, ImageBased, ImageSettings, InteractionMatrix, PoseBased, PoseSettings};
use servo_cases::{Cases, mean};
use std::path::PathBuf;

#[path = "common/servo_cases.rs"]
mod servo_cases;

/// Commands of a loop, those whose errors are printed, and noise of readings and actions [rad].
const COMMANDS: usize = 20;
const PRINTED: [usize; 6] = [0, 1, 2, 3, 5, 10];
const NOISY: f64 = 0.02;

/// ViSP 3.5 at its best, of 10 variants and 11 gains each.
const VISP: [(&str, &str, [f64; 6], usize, f64); 2] = [
    ("mid", "ViSP, image, current, 0.5", [107.3, 57.4, 29.9, 15.5, 4.1, 0.13], 7, 5.1),
    ("eih", "ViSP, image, mean, 0.9", [217.8, 49.6, 10.1, 1.28, 0.02, 0.0], 3, f64::NAN),
];

fn main() {
    let folder = std::env::var_os("HANDEYE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let path = folder.join("cases/servo_ur5.json");
    let Ok(text) = std::fs::read_to_string(&path) else {
        return println!("{} is not there: set HANDEYE_SHARED to its folder", path.display());
    };
    let adaptive = Gain::Adaptive { near: 1.0, far: 0.5, slope: 0.01 };
    let gains = [("1.0", Gain::Constant(1.0)), ("0.5", Gain::Constant(0.5)), ("adaptive", adaptive)];
    for (set, name, errors, under, settled) in VISP {
        let cases = Cases::new(&text, set);
        let title = format!("{set}: mean px after commands");
        let head: Vec<String> = PRINTED.iter().map(|step| format!("{step:8}")).collect();
        println!("{title:40} {} {:>8} {:>8} {:>8}", head.join(" "), "to 1 px", "solved", "noisy");
        print_row(name, &errors, under, 100, settled);
        for matrix in [InteractionMatrix::Current, InteractionMatrix::Desired, InteractionMatrix::Mean] {
            let lower = format!("{matrix:?}").to_lowercase();
            for (label, gain) in gains {
                for infer_joints in [false, true] {
                    let settings = ImageSettings { matrix, gain, infer_joints, ..ImageSettings::default() };
                    let mut servo = ImageBased::new(&cases.rig, settings).expect("complete");
                    let joints = if infer_joints { ", inferred" } else { "" };
                    row(&format!("image, {lower}, {label}{joints}"), &cases, &mut servo);
                }
                let settings = PoseSettings { matrix, gain, ..PoseSettings::default() };
                let mut servo = PoseBased::new(&cases.rig, settings).expect("complete");
                row(&format!("pose, {lower}, {label}"), &cases, &mut servo);
            }
        }
    }
}

fn row(name: &str, cases: &Cases, servo: &mut dyn Controller) {
    let errors = cases.errors(servo, COMMANDS, 0.0, 1);
    let means: Vec<f64> = errors.iter().map(|errors| mean(errors)).collect();
    let commands = |case: usize| errors.iter().position(|errors| errors[case] < 1.0).unwrap_or(COMMANDS + 1);
    let mut under: Vec<usize> = (0..cases.pairs.len()).map(commands).collect();
    under.sort_unstable();
    let solved = errors[COMMANDS].iter().filter(|error| **error < 0.5).count();
    let noisy = cases.errors(servo, COMMANDS, NOISY, 3);
    let settled = mean(&noisy[COMMANDS / 2 + 1..].concat());
    print_row(name, &PRINTED.map(|step| means[step]), under[under.len() / 2], solved, settled);
}

fn print_row(name: &str, errors: &[f64], under: usize, solved: usize, settled: f64) {
    let errors: Vec<String> = errors.iter().map(|error| format!("{error:8.3}")).collect();
    println!("{name:40} {} {under:8} {solved:8} {settled:8.2}", errors.join(" "));
}
