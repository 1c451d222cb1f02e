//! How far the figures of the thesis's table 5.3 (a tracker with Gaussian noise) differ from one draw of the noise to the next.
//!
//! `cargo bench --bench thesis_noise -- [SEEDS]`: for every figure what an independent reconstruction came to with its draw, ours as mean
//! and standard deviation over so many draws, and how many standard deviations of both draws lie between them. Where a figure scatters by
//! more than 8 %, no program agrees with another's draw to 8 % but by luck: that is what the last lines count.
use handeye::experiments::{Options, find};

/// Places of the cameras, as in the thesis.
const PLACES: usize = 360;

/// What is compared, and by how much.
const KINDS: [(&str, Bar); 4] = [
    ("image error", Bar::Share(0.08)),
    ("3D error", Bar::Share(0.08)),
    ("steps to 10 px", Bar::Share(0.08)),
    ("diverged", Bar::Count(8.0)),
];

#[derive(Clone, Copy)]
enum Bar {
    Share(f64),
    Count(f64),
}

impl Bar {
    fn room(self, theirs: f64) -> f64 {
        match self {
            Bar::Share(share) => share * theirs,
            Bar::Count(count) => count,
        }
    }
}

fn main() {
    let seeds = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(20_u64);
    let experiment = find("table5.3").expect("an experiment");
    let run = |seed: u64| experiment.run(&Options { trials: PLACES, seed }).expect("settings that may be");
    let outcomes: Vec<_> = (1..=seeds).map(run).collect();
    println!("{:44} {:>13} {:>10} {:>8} {:>6} {:>10}", "", "reconstructed", "mean", "sd", "apart", "in the bar");
    for (kind, bar) in KINDS {
        let (mut apart, mut inside, mut ideal, mut draws) = (Vec::new(), 0, 0, 0);
        for (index, row) in outcomes[0].rows.iter().enumerate().filter(|(_, row)| row.label.ends_with(kind)) {
            let theirs = row.reconstructed.expect("reconstructed");
            let ours: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.rows[index].mean()).collect();
            let [mean, sd] = moments(&ours);
            let count = ours.iter().filter(|ours| (*ours - theirs).abs() <= bar.room(theirs)).count();
            // Draws that agree to the bar with the next of our own draws: all that another program could hope for.
            let pairs = ours.windows(2).filter(|pair| (pair[0] - pair[1]).abs() <= bar.room(pair[1])).count();
            let z = if sd > 0.0 { (theirs - mean) / (sd * (1.0 + 1.0 / ours.len() as f64).sqrt()) } else { 0.0 };
            println!("{:44} {theirs:>13.5} {mean:>10.5} {sd:>8.5} {z:>6.2} {:>5} of {}", row.label, count, ours.len());
            apart.push(z);
            (inside, ideal, draws) = (inside + count, ideal + pairs, draws + ours.len());
        }
        let rows = apart.len();
        let chi2: f64 = apart.iter().map(|z| z * z).sum();
        let largest = apart.iter().fold(0.0, |most: f64, z| most.max(z.abs()));
        println!(
            "{kind}: χ² {chi2:.1} of {rows} rows, furthest {largest:.1} standard deviations; in the bar {:.1} % of draws, of pairs of our own \
             draws {:.1} %\n",
            100.0 * inside as f64 / draws as f64,
            100.0 * ideal as f64 / (draws - rows).max(1) as f64
        );
    }
}

/// Mean and standard deviation.
fn moments(figures: &[f64]) -> [f64; 2] {
    let n = figures.len() as f64;
    let mean = figures.iter().sum::<f64>() / n;
    [mean, (figures.iter().map(|figure| (figure - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt()]
}
