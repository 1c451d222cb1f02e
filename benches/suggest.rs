//! What suggested joint positions are worth: 10 random samples of random rigs (6 joints, 2 cameras, 12 features, 0.3 px), and more
//! of them, suggested or random.
//!
//! `cargo bench --bench suggest -- [SEEDS]`
use handeye::Error;
use handeye::calibrate::{Calibration, Options, SuggestOptions, calibrate, suggest};
use handeye::recording::Recording;
use handeye::rig::{Estimate, Rig};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::ops::ControlFlow;
use visits::{gauge_alone, tip_error, visit};

#[path = "common/visits.rs"]
mod visits;

/// Samples before, and how many are added.
const BEFORE: usize = 10;
const ADDED: [usize; 3] = [1, 3, 5];

fn main() {
    let seeds = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(60);
    println!("medians over {seeds} rigs; of the tip's position: what calibrate then reports, and the true error");
    println!("{:24} {:>6} {:>19} {:>19} {:>19} {:>17}", "", "", "expected", "without the REC", "random", "over random");
    println!(
        "{:24} {:>6} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8}",
        "learned from",
        "added",
        "expected",
        "suggested",
        "expected",
        "suggested",
        "expected",
        "random",
        "with",
        "without"
    );
    let nothing = |truth: &Rig| Rig { noise: truth.noise, estimate: Estimate::default(), ..Rig::default() };
    let deviation = |learned: &Calibration, _: &Rig, _: u64| learned.report.tip.map_or(f64::NAN, |tip| tip.by_data);
    let error = |learned: &Calibration, truth: &Rig, seed: u64| tip_error(&learned.rig, truth, seed);
    for added in ADDED {
        row("nothing, reported", added, seeds, nothing, false, deviation);
    }
    for added in ADDED {
        row("gauge alone, true error", added, seeds, gauge_alone, true, error);
    }
}

fn row(
    name: &str,
    added: usize,
    seeds: u64,
    start: impl Fn(&Rig) -> Rig,
    is_given: bool,
    judge: impl Fn(&Calibration, &Rig, u64) -> f64,
) {
    let mut columns: [Vec<f64>; 8] = Default::default();
    for seed in 1..=seeds {
        let truth = random_rig(6, 2, 12, seed);
        let (start, before) = (start(&truth), record(&truth, BEFORE, seed));
        let learned = learn(&start, &before).expect("10 samples do");
        let options = SuggestOptions { count: added, ..SuggestOptions::default() };
        let ask =
            |recording| suggest(&learned.rig, recording, is_given.then_some(&start), &options).expect("it has a fit");
        let [with, without] = [ask(Some(&before)), ask(None)];
        let after = |recording: &Recording| judge(&learn(&start, recording).expect("more samples do"), &truth, seed);
        let [suggested, ranked] = [&with, &without].map(|found| after(&visit(&truth, &before, found, seed)));
        let random = after(&record(&truth, BEFORE + added, seed));
        let last = added - 1;
        let numbers = [
            with.samples[last].tip,
            suggested,
            without.samples[last].tip,
            ranked,
            with.samples[last].tip_random,
            random,
            suggested / random,
            ranked / random,
        ];
        columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let [a, b, c, d, e, f, with, without] = columns.each_mut().map(median);
    println!("{name:24} {added:6} {a:9.2e} {b:9.2e} {c:9.2e} {d:9.2e} {e:9.2e} {f:9.2e} {with:8.3} {without:8.3}");
}

fn learn(start: &Rig, recording: &Recording) -> Result<Calibration, Error> {
    calibrate(start, recording, &Options::default(), &mut |_| ControlFlow::Continue(()))
}

fn record(truth: &Rig, samples: usize, seed: u64) -> Recording {
    let options = SimulateOptions { samples, seed, ..SimulateOptions::default() };
    simulate(truth, &options).expect("the rig is in view").recording
}
