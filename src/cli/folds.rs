//! Cross-validation: every sample is predicted by a rig that was learned without it.
use super::progress::Bar;
use super::words::{count, px};
use super::{table::Table, words::errors_json};
use handeye::Error;
use handeye::calibrate::{Errors, Options, calibrate};
use handeye::recording::{Recording, Sample};
use handeye::report::ExtraTable;
use handeye::rig::{Model, Rig};
use serde_json::{Value, json};

const TITLE: &str = "predicted without having been seen";
const HEADER: [&str; 5] = ["held out", "detections", "rms px", "mean px", "median px"];

/// Held-out errors of every fold, and of all folds together.
pub struct Folds {
    folds: Vec<Errors>,
    together: Errors,
}

impl Folds {
    /// Learns the rig `n` times, each time without the samples whose index modulo `n` is that of the fold.
    pub fn new(rig: &Rig, recording: &Recording, n: usize, options: &Options, bar: &Bar) -> Result<Self, Error> {
        if n > recording.samples.len() {
            let samples = recording.samples.len();
            return Err(Error::Unusable(format!(
                "--folds {n}: the recording has {samples} samples, at most that many would do"
            )));
        }
        let (mut folds, mut all) = (Vec::new(), Vec::new());
        for fold in 0..n {
            let prefix = format!("fold {} of {n}: ", fold + 1);
            let rest = recording.select(|index| index % n != fold);
            let learned = calibrate(rig, &rest, options, &mut |progress| bar.show(&prefix, progress))?;
            let held_out = distances(&learned.rig, &recording.select(|index| index % n == fold))?;
            folds.push(Errors::new(&held_out));
            all.extend(held_out);
        }
        Ok(Folds { folds, together: Errors::new(&all) })
    }

    pub fn text(&self) -> String {
        let mut table = Table::new(&HEADER);
        self.rows().into_iter().for_each(|row| table.row(row));
        format!("{TITLE}, in {}:\n{table}", count(self.folds.len(), "fold"))
    }

    /// For a report.
    pub fn as_table(&self) -> ExtraTable {
        let header = HEADER.map(str::to_owned).to_vec();
        ExtraTable { title: TITLE.to_owned(), header, rows: self.rows() }
    }

    /// One row per fold, and one of all.
    fn rows(&self) -> Vec<Vec<String>> {
        let row = |name: String, errors: &Errors| {
            let pixels = [errors.rms_px, errors.mean_px, errors.median_px].map(px);
            [name, errors.observations.to_string()].into_iter().chain(pixels).collect::<Vec<_>>()
        };
        let folds = self.folds.iter().enumerate().map(|(fold, errors)| row(format!("fold {}", fold + 1), errors));
        folds.chain([row("together".to_owned(), &self.together)]).collect()
    }

    pub fn json(&self) -> Value {
        let mut object = errors_json(&self.together);
        object.insert("folds".to_owned(), self.folds.iter().map(|errors| Value::Object(errors_json(errors))).collect());
        json!(object)
    }
}

/// Pixel distances of every detection that the rig can predict, and whether it is predicted behind the camera.
fn distances(rig: &Rig, recording: &Recording) -> Result<Vec<(f64, bool)>, Error> {
    let model = Model::new(rig)?;
    let cameras: Vec<Option<usize>> = recording
        .cameras
        .iter()
        .map(|recorded| rig.cameras.iter().position(|camera| camera.name == recorded.name))
        .collect();
    let features: Vec<Option<usize>> =
        recording.features.iter().map(|name| rig.features.iter().position(|feature| feature.name == *name)).collect();
    let of_sample = |sample: &Sample| -> Vec<(f64, bool)> {
        let Some(joints) = &sample.joints else { return Vec::new() };
        let links = model.links(joints);
        let distance = |detection: &handeye::recording::Detection| {
            let (camera, feature) = (cameras[detection.camera as usize]?, features[detection.feature as usize]?);
            let [u, v] = model.pixel(camera, feature, &links);
            let is_in_front = model.cameras[camera].model.is_in_front(&model.in_camera(camera, feature, &links));
            Some(((u - detection.pixel[0]).hypot(v - detection.pixel[1]), !is_in_front))
        };
        sample.pixels.iter().filter_map(distance).collect()
    };
    Ok(recording.samples.iter().flat_map(of_sample).collect())
}
