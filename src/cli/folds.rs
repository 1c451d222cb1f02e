//! Cross-validation: every sample is predicted by a rig that was learned without it.
use super::progress::Bar;
use super::table::Table;
use super::words::{ErrorColumns, count, errors_json, mm, px};
use handeye::Error;
use handeye::calibrate::{Distances, Errors, Options, calibrate, distances};
use handeye::recording::Recording;
use handeye::report::ExtraTable;
use handeye::rig::Rig;
use serde_json::{Value, json};

const TITLE: &str = "predicted without having been seen";

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
        let (mut folds, mut all) = (Vec::new(), Distances::default());
        for fold in 0..n {
            let prefix = format!("fold {} of {n}: ", fold + 1);
            let rest = recording.select(|index| index % n != fold);
            let learned = calibrate(rig, &rest, options, &mut |progress| bar.show(&prefix, progress))?;
            let held_out = all_distances(&learned.rig, &recording.select(|index| index % n == fold))?;
            folds.push(Errors::new(&held_out));
            all.extend(&held_out);
        }
        Ok(Folds { folds, together: Errors::new(&all) })
    }

    pub fn text(&self) -> String {
        let header = self.header();
        let mut table = Table::new(&header);
        self.rows().into_iter().for_each(|row| table.row(row));
        format!("{TITLE}, in {}:\n{table}", count(self.folds.len(), "fold"))
    }

    /// For a report.
    pub fn as_table(&self) -> ExtraTable {
        let header = self.header().into_iter().map(str::to_owned).collect();
        ExtraTable { title: TITLE.to_owned(), header, rows: self.rows(), in_short: self.in_short() }
    }

    fn in_short(&self) -> String {
        let Errors { rms_px, median_px, points, observations, .. } = &self.together;
        let of_pixels = || format!("{} px rms ({} px in the median)", px(*rms_px), px(*median_px));
        let of_points = || format!("{} mm rms ({} mm in the median)", mm(points.rms_m), mm(points.median_m));
        let pixels = (*observations > points.observations).then(of_pixels);
        let figures: Vec<String> = pixels.into_iter().chain((points.observations > 0).then(of_points)).collect();
        let (folds, figures) = (self.folds.len(), figures.join(" and "));
        format!("Samples that it was not learned from, by {folds} folds, it predicts to {figures}.")
    }

    fn header(&self) -> Vec<&'static str> {
        [&["held out", "detections"][..], &ErrorColumns::new(&self.together).header()].concat()
    }

    /// One row per fold, and one of all.
    fn rows(&self) -> Vec<Vec<String>> {
        let columns = ErrorColumns::new(&self.together);
        let row = |name: String, errors: &Errors| {
            [name, errors.observations.to_string()].into_iter().chain(columns.cells(errors)).collect::<Vec<_>>()
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

/// Distances of every detection that the rig can predict.
fn all_distances(rig: &Rig, recording: &Recording) -> Result<Distances, Error> {
    let mut all = Distances::default();
    let samples = distances(rig, recording)?;
    samples.iter().flat_map(|sample| &sample.cameras).for_each(|of_camera| all.extend(of_camera));
    Ok(all)
}
