//! Numbers and lists as people read them, and the errors that several commands report.
use super::table::Table;
use handeye::calibrate::{CameraErrors, Errors};
use serde_json::{Map, Value, json};

/// "1 sample", "2 samples".
pub fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// The first few of many names.
pub fn list(names: &[String]) -> String {
    const MOST: usize = 8;
    let first = names.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
    if names.len() > MOST { format!("{first} and {} more", names.len() - MOST) } else { first }
}

/// Pixels with as many digits as can matter.
pub fn px(value: f64) -> String {
    format!("{value:.3}")
}

/// A time as people tell it.
pub fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", 1e3 * seconds) } else { format!("{seconds:.1} s") }
}

/// Errors per camera and together, one row each.
pub fn error_table(cameras: &[CameraErrors], together: &Errors, rejected: usize) -> Table {
    let mut table = Table::new(&["camera", "detections", "left out", "rms px", "mean px", "median px", "largest px"]);
    let row = |name: &str, errors: &Errors, rejected: usize| {
        let pixels = [errors.rms_px, errors.mean_px, errors.median_px, errors.max_px].map(px);
        let counts = [errors.observations.to_string(), rejected.to_string()];
        [name.to_owned()].into_iter().chain(counts).chain(pixels).collect::<Vec<_>>()
    };
    for camera in cameras {
        table.row(row(&camera.name, &camera.errors, camera.rejected));
    }
    table.row(row("together", together, rejected));
    table
}

/// The keys that every report of errors has.
pub fn errors_json(errors: &Errors) -> Map<String, Value> {
    let pairs = [
        ("observations", json!(errors.observations)),
        ("rms_px", json!(errors.rms_px)),
        ("mean_px", json!(errors.mean_px)),
        ("median_px", json!(errors.median_px)),
        ("max_px", json!(errors.max_px)),
        ("behind", json!(errors.behind)),
    ];
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// Camera -> its errors.
pub fn cameras_json(cameras: &[CameraErrors]) -> Value {
    let entry = |camera: &CameraErrors| {
        let mut errors = errors_json(&camera.errors);
        errors.insert("rejected".to_owned(), json!(camera.rejected));
        (camera.name.clone(), Value::Object(errors))
    };
    Value::Object(cameras.iter().map(entry).collect())
}
