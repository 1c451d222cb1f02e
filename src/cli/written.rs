//! What is said of a recording that was written.
use super::answer::Answer;
use super::words::count;
use handeye::recording::{Recording, Sample};
use serde_json::json;
use std::path::Path;

/// Its counts, and what there is to know of how it was read.
pub fn written(output: &Path, recording: &Recording, notes: &[String]) -> Answer {
    let sum = |of: fn(&Sample) -> usize| recording.samples.iter().map(of).sum::<usize>();
    let (detections, targets) = (sum(|sample| sample.pixels.len()), sum(|sample| sample.targets.len()));
    let text = format!(
        "{}: {}{}, {} with {}, {}{}\n{}",
        output.display(),
        count(recording.samples.len(), "sample"),
        match recording.joints.len() {
            0 => String::new(),
            joints => format!(" of {}", count(joints, "joint")),
        },
        count(recording.cameras.len(), "camera"),
        count(recording.features.len(), "feature"),
        count(detections, "detection"),
        if targets > 0 { format!(", {}", count(targets, "target pose")) } else { String::new() },
        notes.iter().map(|note| format!("  {note}\n")).collect::<String>()
    );
    let json = json!({
        "output": output.display().to_string(),
        "samples": recording.samples.len(),
        "joints": recording.joints,
        "cameras": recording.cameras.iter().map(|camera| &camera.name).collect::<Vec<_>>(),
        "features": recording.features.len(),
        "detections": detections,
        "targets": targets,
        "notes": notes,
    });
    Answer::new(text, json)
}
