//! Change detection: alarms of an unchanged rig, and how soon and as what a change is found.
//!
//! `cargo bench --bench change -- [TRIALS] [SAMPLES]`. Random rigs of 6 joints, 2 cameras and 12 features, 0.3 px, learned
//! from 50 samples; 50 unchanged samples, then one part moves so that pixels shift by 5 px in the median (a camera: in its own
//! images). *False alarms*: SAMPLES of each of TRIALS / 10 unchanged rigs.
#[path = "common/change.rs"]
mod change;

use change::{KINDS, learned, look, unchanged};

fn main() {
    let numbers: Vec<usize> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let trials = numbers.first().copied().unwrap_or(100) as u64;
    let samples = numbers.get(1).copied().unwrap_or(2_000);
    let rigs: Vec<_> = (1..=trials).filter_map(|seed| Some((seed, learned(seed)?))).collect();
    println!("{} of {trials} rigs learned", rigs.len());
    let few = (trials as usize / 10).max(1);
    let counts: Vec<(usize, usize)> =
        rigs.iter().take(few).map(|(seed, rigs)| unchanged(*seed, rigs, samples)).collect();
    let sum = |pick: fn(&(usize, usize)) -> usize| counts.iter().map(pick).sum::<usize>();
    println!("{} false alarms and {} steps in {} samples\n", sum(|c| c.0), sum(|c| c.1), counts.len() * samples);
    println!("{:12} {:>10} {:>10} {:>12} {:>12}", "moved", "found in 3", "right", "right after", "factor");
    for kind in KINDS {
        let looks: Vec<_> = rigs.iter().map(|(seed, rigs)| look(*seed, rigs, kind)).collect();
        let share = |pick: &dyn Fn(&change::Look) -> bool| {
            format!("{:.0} %", 100.0 * looks.iter().filter(|l| pick(l)).count() as f64 / looks.len() as f64)
        };
        let mut factors: Vec<f64> = looks.iter().map(|look| look.factor).collect();
        factors.sort_by(f64::total_cmp);
        println!(
            "{:12} {:>10} {:>10} {:>12} {:12.3}",
            format!("{kind:?}"),
            share(&|l| l.delay.is_some_and(|delay| delay <= 3)),
            share(&|l| l.named),
            share(&|l| l.relearned),
            factors[factors.len() / 2]
        );
    }
}
