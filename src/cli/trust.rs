//! How much of a calibration to trust, for people and for programs.
use super::table::Table;
use super::words::{mm, px, seconds};
use handeye::calibrate::{
    Combination, DeterminedBy, Influence, Report, length_in_words, most_influential, worst_fitting,
};
use handeye::recording::Recording;
use serde_json::{Value, json};

/// Samples that are listed.
const LISTED: usize = 10;

/// The samples that matter most, where that was asked for.
pub fn text(report: &Report, recording: &Recording) -> String {
    if report.influence.is_empty() {
        return String::new();
    }
    let has_times = recording.samples.iter().any(|sample| sample.time.is_some());
    let has_points = report.points.observations > 0;
    let mut text = String::new();
    for (title, samples) in [
        ("the most influential samples", most_influential(&report.influence, LISTED)),
        ("the samples that fit worst", worst_fitting(&report.influence, LISTED)),
    ] {
        if samples.is_empty() {
            continue;
        }
        let header = ["sample"].into_iter().chain(has_times.then_some("time s"));
        let header = header.chain(["without it the tip moves", "rms px"]).chain(has_points.then_some("rms mm"));
        let mut table = Table::new(&header.collect::<Vec<_>>());
        for Influence { sample, tip, rms_px, rms_points_m, .. } in samples {
            let tip = match tip {
                Some(tip) if !tip.is_finite() => "nothing holds it".to_owned(),
                Some(tip) => length_in_words(tip, report.metric),
                None => "-".to_owned(),
            };
            let time = recording.samples[sample].time.map_or_else(|| "-".to_owned(), seconds);
            let row = [sample.to_string()].into_iter().chain(has_times.then_some(time));
            table.row(row.chain([tip, px(rms_px)]).chain(has_points.then(|| mm(rms_points_m))));
        }
        text += &format!("\n{title} (numbered from 0):\n{table}");
    }
    text
}

/// A weak combination.
pub fn weak_json(weak: &Combination) -> Value {
    let (determined_by, sd_ratio, sd) = match weak.determined_by {
        DeterminedBy::Nothing => ("nothing", None, None),
        DeterminedBy::Prior(ratio) => ("prior", ratio.is_finite().then_some(ratio), None),
        DeterminedBy::Poorly { sd, .. } => ("data, poorly", None, Some(sd)),
    };
    let numbers: Vec<Value> = weak.numbers.iter().map(|(path, by)| json!({ "path": path, "weight": by })).collect();
    json!({
        "numbers": numbers,
        "moves": weak.moves,
        "determined_by": determined_by,
        "sd_data_over_prior": sd_ratio,
        "sd": sd,
        "tip_sd": weak.tip,
        "camera": weak.camera.as_ref().map(|(name, by)| json!({ "name": name, "sd": by })),
        "cure": weak.cure,
        "text": weak.to_string(),
    })
}

/// The most influential and the worst-fitting samples; null where that was not asked for.
pub fn influence_json(all: &[Influence], recording: &Recording) -> Value {
    if all.is_empty() {
        return Value::Null;
    }
    let list = |samples: Vec<Influence>| -> Vec<Value> {
        let one = |one: Influence| {
            let (px, mm) = (one.rms_px, 1e3 * one.rms_points_m);
            let time = recording.samples[one.sample].time;
            json!({ "sample": one.sample, "time": time, "tip": one.tip, "rms_px": px, "rms_points_mm": mm })
        };
        samples.into_iter().map(one).collect()
    };
    json!({
        "most_influential": list(most_influential(all, LISTED)),
        "worst_fitting": list(worst_fitting(all, LISTED)),
    })
}
