//! `handeye simulate`: a complete rig to a recording.
use super::answer::Answer;
use super::inputs::{check_output, read_rig};
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::rig::files_named;
use handeye::simulate::{SimulateOptions, simulate};
use serde_json::{Map, json};
use std::path::PathBuf;

/// Record random motions of a complete rig, with the rig's noise
///
/// Joint positions are uniform within the limits, wherever every camera has enough of the features in view. Noise is that of
/// the rig's [noise]; tip poses and actions are recorded where it gives noise for them.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye simulate ur5 --samples 50 --seed 1 -o motions.jsonl
  handeye simulate arm.toml --samples 200 --missed 0.3 --outliers 0.05 -o motions.jsonl --truth truth.jsonl")]
pub struct Simulate {
    /// A rig file in which every value is given, or the name of a shipped rig (ur5)
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// How many samples to record
    #[arg(long, value_name = "N", default_value_t = SimulateOptions::default().samples)]
    samples: usize,
    /// Seed of every random choice: the same seed gives the same recording
    #[arg(long, value_name = "S", default_value_t = SimulateOptions::default().seed)]
    seed: u64,
    /// Probability that a feature in view is not detected
    #[arg(long, value_name = "P", default_value_t = SimulateOptions::default().missed)]
    missed: f64,
    /// Probability that a detection is anywhere in the image
    #[arg(long, value_name = "P", default_value_t = SimulateOptions::default().outliers)]
    outliers: f64,
    /// Share of the features that every camera has in view in every sample
    #[arg(long, value_name = "SHARE", default_value_t = SimulateOptions::default().in_view)]
    in_view: f64,
    /// The recording to write
    #[arg(short, long, value_name = "REC")]
    output: PathBuf,
    /// Also write the states and pixels without noise
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
}

impl Simulate {
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        let inputs = [vec![self.rig.clone()], files_named(&self.rig)].concat();
        check_output(&self.output, &inputs)?;
        if let Some(truth) = &self.truth {
            check_output(truth, &inputs)?;
            if *truth == self.output {
                return Err(Error::Unusable(format!("{}: given for two outputs", truth.display())));
            }
        }
        let options = SimulateOptions {
            samples: self.samples,
            seed: self.seed,
            missed: self.missed,
            outliers: self.outliers,
            in_view: self.in_view,
            ..SimulateOptions::default()
        };
        let simulation = simulate(&input.rig, &options)?;
        simulation.recording.write(&self.output)?;
        if let Some(truth) = &self.truth {
            simulation.truth.write(truth)?;
        }

        let recording = &simulation.recording;
        let mut cameras = Map::new();
        for (index, camera) in recording.cameras.iter().enumerate() {
            let pixels = recording.samples.iter().flat_map(|sample| &sample.pixels);
            let points = recording.samples.iter().flat_map(|sample| &sample.points);
            let pixels = pixels.filter(|seen| seen.camera as usize == index).count();
            let points = points.filter(|seen| seen.camera as usize == index).count();
            cameras.insert(camera.name.clone(), json!({ "observations": pixels + points, "points": points }));
        }
        let points: usize = recording.samples.iter().map(|sample| sample.points.len()).sum();
        let observations = points + recording.samples.iter().map(|sample| sample.pixels.len()).sum::<usize>();
        let json = json!({
            "rig": input.name,
            "samples": recording.samples.len(),
            "observations": observations,
            "points": points,
            "missed": simulation.missed,
            "outliers": simulation.outliers,
            "cameras": cameras,
            "recording": self.output.display().to_string(),
            "truth": self.truth.as_ref().map(|path| path.display().to_string()),
        });
        let of_points = format!(" and, of {}, {:.3} mm", count(points, "point"), 1e3 * input.rig.noise.points);
        let text = format!(
            "{} with {}: {} px noise per axis{}, {} missed, {} gross outliers\nnext: handeye calibrate {} -o learned.toml\n",
            count(recording.samples.len(), "sample"),
            count(observations, "detection"),
            input.rig.noise.pixels,
            if points > 0 { of_points } else { String::new() },
            simulation.missed,
            simulation.outliers,
            self.output.display(),
        );
        Ok(Answer::new(text, json))
    }
}
