//! Numbers and lists as people read them, and the errors that several commands report.
use super::table::Table;
use handeye::calibrate::{CameraErrors, Errors, PointErrors};
use serde_json::{Map, Value, json};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

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

/// Metres as millimetres, with as many digits as can matter.
pub fn mm(value: f64) -> String {
    format!("{:.3}", 1e3 * value)
}

/// The command as it is typed in a shell, whatever path the program was called by.
pub fn as_typed(arguments: &[OsString]) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=,:@%+".contains(c);
    let quoted = |argument: &OsString| {
        let text = argument.to_string_lossy();
        let is_plain = !text.is_empty() && text.chars().all(is_plain);
        if is_plain { text.into_owned() } else { format!("'{}'", text.replace('\'', "'\\''")) }
    };
    ["handeye".to_owned()].into_iter().chain(arguments.iter().skip(1).map(quoted)).collect::<Vec<_>>().join(" ")
}

/// Names of files without their folders, the first few of many.
pub fn file_names(paths: &[PathBuf]) -> String {
    list(&paths.iter().map(|path| file_name(path)).collect::<Vec<_>>())
}

/// The name of a file without its folder.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// A moment of a recording [s].
pub fn seconds(time: f64) -> String {
    format!("{time:.3}")
}

/// A time as people tell it.
pub fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", 1e3 * seconds) } else { format!("{seconds:.1} s") }
}

/// Errors per camera and together, one row each.
pub fn error_table(cameras: &[CameraErrors], together: &Errors, rejected: usize) -> Table {
    let columns = ErrorColumns::new(together);
    let mut table = Table::new(&[&["camera", "detections", "left out"][..], &columns.header()].concat());
    let mut row = |name: &str, errors: &Errors, rejected: usize| {
        let counts = [name.to_owned(), errors.observations.to_string(), rejected.to_string()];
        table.row(counts.into_iter().chain(columns.cells(errors)));
    };
    for camera in cameras {
        row(&camera.name, &camera.errors, camera.rejected);
    }
    row("together", together, rejected);
    table
}

/// Columns of errors: of pixels, of points, or of both.
pub struct ErrorColumns {
    pixels: bool,
    points: bool,
}

impl ErrorColumns {
    /// For a table of which these are the errors of all.
    pub fn new(together: &Errors) -> Self {
        let points = together.points.observations > 0;
        ErrorColumns { pixels: !points || has_pixels(together), points }
    }

    pub fn header(&self) -> Vec<&'static str> {
        let pixels = ["rms px", "mean px", "median px", "largest px"].into_iter().filter(|_| self.pixels);
        let points = ["points", "rms mm", "mean mm", "median mm", "largest mm"].into_iter().filter(|_| self.points);
        pixels.chain(points).collect()
    }

    pub fn cells(&self, errors: &Errors) -> Vec<String> {
        let points = &errors.points;
        let mut cells = Vec::new();
        if self.pixels {
            let pixels = [errors.rms_px, errors.mean_px, errors.median_px, errors.max_px].map(px);
            cells.extend(if has_pixels(errors) || !self.points { pixels } else { dashes() });
        }
        if self.points {
            cells.push(points.observations.to_string());
            let lengths = [points.rms_m, points.mean_m, points.median_m, points.max_m].map(mm);
            cells.extend(if points.observations > 0 { lengths } else { dashes() });
        }
        cells
    }
}

fn has_pixels(errors: &Errors) -> bool {
    errors.observations > errors.points.observations
}

/// Cells of what there is nothing of.
fn dashes() -> [String; 4] {
    std::array::from_fn(|_| "-".to_owned())
}

/// The keys that every report of errors has, and `points` where there are any.
pub fn errors_json(errors: &Errors) -> Map<String, Value> {
    let pairs = [
        ("observations", json!(errors.observations)),
        ("rms_px", json!(errors.rms_px)),
        ("mean_px", json!(errors.mean_px)),
        ("median_px", json!(errors.median_px)),
        ("max_px", json!(errors.max_px)),
        ("behind", json!(errors.behind)),
    ];
    let points = (errors.points.observations > 0).then(|| ("points", points_json(&errors.points)));
    pairs.into_iter().chain(points).map(|(key, value)| (key.to_owned(), value)).collect()
}

/// Distances of points; null where there are none.
pub fn points_json(points: &PointErrors) -> Value {
    if points.observations == 0 {
        return Value::Null;
    }
    let [rms, mean, median, max] = [points.rms_m, points.mean_m, points.median_m, points.max_m].map(|m| 1e3 * m);
    json!({ "observations": points.observations, "rms_mm": rms, "mean_mm": mean, "median_mm": median, "max_mm": max })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_told_as_a_shell_takes_it() {
        let arguments = ["/opt/handeye", "evaluate", "my rig.toml", "it's.jsonl", "--join=0.5", ""].map(OsString::from);
        assert_eq!(as_typed(&arguments), r"handeye evaluate 'my rig.toml' 'it'\''s.jsonl' --join=0.5 ''");
    }
}
