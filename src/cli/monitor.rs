//! `handeye monitor`: watches a learned rig over recordings, and says what of it moved.
use super::answer::Answer;
use super::inputs::{check_output, files_read, read_recordings, read_rig};
use super::reading::Reading;
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::online::{Cause, Event, Monitor, MonitorOptions};
use handeye::rig::Rig;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Watch a learned rig: say when it no longer predicts what is seen, which part moved, and learn that part again
///
/// A camera, the structure on the tip, the base or the zero of a joint. Samples are taken in order, as they were recorded.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye monitor learned.toml today.jsonl
  handeye monitor learned.toml today.jsonl -o learned.toml    with what was learned again")]
pub struct MonitorCommand {
    /// A rig file in which every value is given
    #[arg(value_name = "LEARNED")]
    rig: PathBuf,
    /// Recordings of that rig, in the order of time
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// The rig file to write, with what was learned again; may be LEARNED
    #[arg(short, long, value_name = "UPDATED")]
    output: Option<PathBuf>,
    /// Largest probability of an alarm at a sample of an unchanged rig
    #[arg(long, value_name = "P", default_value_t = MonitorOptions::default().false_alarm_rate)]
    false_alarms: f64,
    #[command(flatten)]
    reading: Reading,
}

impl MonitorCommand {
    pub fn run(&self) -> Result<Answer, Error> {
        let input = read_rig(&self.rig)?;
        let recording = read_recordings(&self.recordings, Some(&input), &self.reading)?;
        if let Some(output) = &self.output {
            // LEARNED itself may be replaced, what it names not.
            check_output(output, &files_read(&self.recordings, Some(&self.rig), &self.reading))?;
        }
        let options = MonitorOptions { false_alarm_rate: self.false_alarms, ..MonitorOptions::default() };
        let mut monitor = Monitor::new(&input.rig, &recording, options)?;
        let (mut text, mut events) = (String::new(), Vec::new());
        let (mut changes, mut followed, mut skipped) = (0, 0, 0);
        for (sample, measured) in recording.samples.iter().enumerate() {
            let event = monitor.observe(measured);
            changes += usize::from(matches!(event, Event::Changed(_)));
            followed += usize::from(matches!(event, Event::Followed { .. }));
            skipped += usize::from(event == Event::Skipped);
            if let Some((line, object)) = tell(sample, &event, &input.rig) {
                text += &line;
                events.push(object);
            }
        }
        let watched = recording.samples.len() - skipped;
        let points: usize = recording.samples.iter().map(|sample| sample.points.len()).sum();
        if watched == 0 {
            let problem = "no sample has joints and an image with three detections of features that the rig knows";
            let unused = if points > 0 { "; points of depth cameras are not watched" } else { "" };
            return Err(Error::NotEnoughData(format!("{problem}: fewer cannot be told from wrong detections{unused}")));
        }
        let summary = if changes == 0 { "no sudden change".to_owned() } else { count(changes, "sudden change") };
        let summary = match followed {
            0 if changes == 0 => "no change".to_owned(),
            0 => count(changes, "change"),
            _ => format!("{summary}; a slow drift was followed in {}", count(followed, "small step")),
        };
        text += &format!("{summary} in {}\n", count(watched, "sample"));
        if skipped > 0 {
            text += &format!(
                "{} without joints or without an image that has three detections to compare\n",
                count(skipped, "sample")
            );
        }
        if points > 0 {
            text += &format!("{} of depth cameras not watched: pixels alone are\n", count(points, "point"));
        }
        let left_out = monitor.left_out().map(|cause| cause.name(&input.rig));
        if let Some(name) = &left_out {
            text += &format!("{name} is left out: too few samples since it moved\n");
        }
        let mut json = json!({
            "samples": watched,
            "skipped": skipped,
            "points_not_watched": points,
            "changes": changes,
            "followed": followed,
            "false_alarm_rate": self.false_alarms,
            "gradient_norm": monitor.gradient_norm(),
            "left_out": left_out,
            "events": events,
        });
        if let Some(output) = &self.output {
            monitor.rig().write(output, Some(&input.text))?;
            json["updated"] = json!(output.display().to_string());
            text += &format!("wrote {}\n", output.display());
        }
        Ok(Answer::new(text, json))
    }
}

/// Smaller probabilities are printed as this one.
const LEAST_P: f64 = 1e-100;

/// A line and an object, where something happened.
fn tell(sample: usize, event: &Event, rig: &Rig) -> Option<(String, Value)> {
    match event {
        Event::Skipped | Event::Unchanged => None,
        Event::Changed(change) => {
            let name = change.cause.name(rig);
            let others: Vec<String> = change.as_good().map(|cause| cause.name(rig)).collect();
            let or = if others.is_empty() { String::new() } else { format!(" (or {})", others.join(", ")) };
            let (since, p) = (change.since, change.p_value.max(LEAST_P));
            let what = match change.cause {
                Cause::Unexplained => format!("more than one part, or something else, changed at sample {since}"),
                _ => format!("{name}{or} moved at sample {since}"),
            };
            let line = format!("sample {sample}: {what} (p < {p:.0e} of a false alarm)\n");
            let scores: Vec<Value> = change
                .scores
                .iter()
                .map(|score| json!({"cause": score.cause.name(rig), "bic": score.bic, "median_px": score.median_px}))
                .collect();
            let object = json!({"event": "changed", "sample": sample, "since": change.since, "cause": name,
                "as_good": others, "p_value": change.p_value, "scores": scores});
            Some((line, object))
        }
        Event::Relearned { cause, samples, .. } => {
            let name = cause.name(rig);
            let line = format!("sample {sample}: {name} learned again from {}\n", count(*samples, "sample"));
            Some((line, json!({"event": "relearned", "sample": sample, "cause": name, "samples": samples})))
        }
        Event::Followed { cause, gradient_norm } => {
            let name = cause.name(rig);
            let line = format!("sample {sample}: {name} drifts, followed (gradient norm {gradient_norm:.3})\n");
            let object = json!({"event": "followed", "sample": sample, "cause": name, "gradient_norm": gradient_norm});
            Some((line, object))
        }
    }
}
