//! `handeye demo`: the whole story on a simulated robot.
use super::answer::Answer;
use super::calibrate::report_json;
use super::progress::Bar;
use super::table::Table;
use super::words::{count, duration, px};
use super::{counts::learned_in_words, evaluate};
use clap::Args;
use handeye::Error;
use handeye::calibrate::{Errors, Options, calibrate};
use handeye::rig::{Rig, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use serde_json::json;
use std::f64::consts::{LN_2, PI};

const RIG: &str = "ur5";

/// Simulate a robot before two cameras, forget it, learn it back, and judge the result on fresh motions
///
/// Needs no file, and writes none.
#[derive(Args)]
pub struct Demo {
    /// How many samples to learn from, and to judge on
    #[arg(long, value_name = "N", default_value_t = 50)]
    samples: usize,
    /// Seed of the simulated motions and their noise
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

impl Demo {
    pub fn run(&self, is_json: bool) -> Result<Answer, Error> {
        let rig = catalog::rig(RIG)?;
        let record = |seed| {
            simulate(&rig, &SimulateOptions { samples: self.samples, seed, ..SimulateOptions::default() })
                .map(|simulation| simulation.recording)
        };
        let (recording, fresh) = (record(self.seed)?, record(self.seed.wrapping_add(1))?);

        let bar = Bar::new(is_json);
        let options = Options { seed: self.seed, ..Options::default() };
        let start = std::time::Instant::now();
        let learned = calibrate(&Rig::default(), &recording, &options, &mut |progress| bar.show("", progress))?;
        let seconds = start.elapsed().as_secs_f64();
        drop(bar);
        let judged = handeye::calibrate::evaluate(&learned.rig, &fresh)?;
        let floor = floor(rig.noise.pixels);
        let ratio = judged.total.rms_px / floor.rms_px;

        let observations: usize = recording.samples.iter().map(|sample| sample.pixels.len()).sum();
        let mut text = format!(
            "1. {}, moves at random: {}, {}, {} px noise per axis.\n",
            rig.name.as_deref().unwrap_or(RIG),
            count(recording.samples.len(), "sample"),
            count(observations, "detection"),
            rig.noise.pixels,
        );
        text += &format!(
            "2. The rig is forgotten, and learned from the recording alone in {}:\n   {}.\n",
            duration(seconds),
            learned_in_words(&Rig::default(), &learned.rig)
        );
        if !learned.report.gauge.is_empty() {
            text += "   What pixels and joints leave open is fixed by rule:\n";
            learned.report.gauge.iter().for_each(|line| text += &format!("     {line}\n"));
        }
        text += &format!(
            "3. What was learned predicts the pixels of {} more from their joints:\n\n",
            count(fresh.samples.len(), "sample")
        );
        let mut table = Table::new(&["", "rms px", "mean px", "median px"]);
        for (name, errors) in [("the noise alone", &floor), ("learned, fresh samples", &judged.total)] {
            let pixels = [errors.rms_px, errors.mean_px, errors.median_px].map(px);
            table.row([name.to_owned()].into_iter().chain(pixels));
        }
        text += &format!("{table}\n   {ratio:.3} times the noise that no model can predict.\n");
        text += "\nnext: handeye calibrate YOUR-RECORDING.jsonl -o learned.toml\n";

        let json = json!({
            "rig": RIG,
            "seed": self.seed,
            "noise_px": rig.noise.pixels,
            "floor": { "rms_px": floor.rms_px, "mean_px": floor.mean_px, "median_px": floor.median_px },
            "seconds": seconds,
            "calibration": report_json(&learned.report, &recording),
            "evaluation": evaluate::json(&learned.rig, &judged),
            "rms_over_floor": ratio,
        });
        let mut answer = Answer::new(text, json);
        if !learned.report.converged {
            answer.failure = Some("no minimum was reached; more samples would do".to_owned());
        }
        Ok(answer)
    }
}

/// Pixel distances of pure noise: Rayleigh's distribution, with this standard deviation per axis.
fn floor(sd: f64) -> Errors {
    Errors {
        rms_px: sd * 2.0_f64.sqrt(),
        mean_px: sd * (PI / 2.0).sqrt(),
        median_px: sd * (2.0 * LN_2).sqrt(),
        ..Errors::default()
    }
}
