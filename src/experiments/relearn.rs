//! Relearning one part of a rig whose other parts are known: from random starts, as for figures 4 to 6.
use super::graph::{Free, Problem, with_model};
use super::setting::{columns, held_out, record, trials};
use super::{Options, Row};
use crate::Error;
use crate::calibrate::evaluate;
use crate::recording::Recording;
use crate::rig::{Model, Rig};
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{LevenbergMarquardt, Pose};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Samples that the new part is learned from.
pub(super) const SAMPLES: [usize; 8] = [1, 2, 3, 4, 5, 6, 8, 10];

/// Random starts, at most; no more where one fits, which is where the loss per coordinate is below a multiple of ½.
const STARTS: usize = 60;
const FITS: f64 = 4.0;

/// One curve: a part that is new, and what is free when it is learned.
pub(super) struct Curve<'a> {
    pub series: &'static str,
    pub truth: &'a Rig,
    pub free: Free<'a>,
    /// A random start: the true model with its new part at random. The recording says where the arm goes.
    pub draw: fn(&Model, &Recording, &mut Draw) -> Model,
    /// Camera by which it is judged; all where `None`.
    pub camera: Option<usize>,
}

/// Mean pixel distance on held-out samples after learning from each of [`SAMPLES`].
pub(super) fn rows(options: &Options, curve: &Curve<'_>) -> Result<Vec<Row>, Error> {
    let results = trials(options, |seed| {
        let mut recording = record(curve.truth, SAMPLES[SAMPLES.len() - 1], seed)?;
        let fresh = held_out(curve.truth, seed)?;
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
        blur_intrinsics(&mut recording, curve.free.cameras, &mut draw);
        let judge = |samples: usize, draw: &mut Draw| -> Result<Option<f64>, Error> {
            let learned = relearn(curve, &recording.select(|index| index < samples), draw)?;
            let judged = evaluate(&with_model(curve.truth, &learned), &fresh)?;
            let errors = curve.camera.map_or(&judged.total, |camera| &judged.cameras[camera].errors);
            Ok(Some(errors.mean_px))
        };
        SAMPLES.iter().map(|&samples| judge(samples, &mut draw)).collect::<Result<Vec<_>, Error>>()
    })?;
    let row = |(samples, ours): (usize, Vec<Option<f64>>)| {
        let label = format!("{}, {samples} sample{}", curve.series, if samples == 1 { "" } else { "s" });
        Row::new(label, None, &ours).at(curve.series, samples as f64)
    };
    Ok(SAMPLES.into_iter().zip(columns(&results)).map(row).collect())
}

/// The best of several random starts.
fn relearn(curve: &Curve<'_>, recording: &Recording, draw: &mut Draw) -> Result<Model, Error> {
    let held = Model::new(curve.truth)?;
    let mut best: Option<(f64, Model)> = None;
    for _ in 0..STARTS {
        let mut start = (curve.draw)(&held, recording, draw);
        for &camera in curve.free.cameras {
            take_header(&mut start, camera, &curve.truth.cameras[camera].name, recording);
        }
        let mut problem = Problem::new(curve.truth, &start, recording, &curve.free)?;
        // A start from which the minimiser cannot go on is one of many.
        let Ok(report) = LevenbergMarquardt::default().minimize(&mut problem.graph) else { continue };
        if best.as_ref().is_none_or(|(cost, _)| report.final_cost < *cost) {
            problem.read(&mut start);
            best = Some((report.final_cost, start));
        }
        if report.final_cost < FITS * problem.detections as f64 {
            break;
        }
    }
    best.map(|(_, model)| model)
        .ok_or_else(|| Error::NotEnoughData("no random start of the new part led anywhere".to_owned()))
}

/// The header's intrinsics of cameras that are learned are 3 % off (standard deviation), as those from a factory.
fn blur_intrinsics(recording: &mut Recording, cameras: &[usize], draw: &mut Draw) {
    for &camera in cameras {
        let header = &mut recording.cameras[camera];
        let side = header.size.map_or(0.0, |[width, height]| f64::from(width.max(height)));
        for focal in [&mut header.fx, &mut header.fy].into_iter().flatten() {
            *focal *= 1.0 + draw.normal(0.03);
        }
        for centre in [&mut header.cx, &mut header.cy].into_iter().flatten() {
            *centre += draw.normal(0.02) * side;
        }
    }
}

fn take_header(model: &mut Model, camera: usize, name: &str, recording: &Recording) {
    let Some(header) = recording.cameras.iter().find(|recorded| recorded.name == name) else { return };
    for (slot, value) in model.cameras[camera].intrinsics.iter_mut().zip([header.fx, header.fy, header.cx, header.cy]) {
        *slot = value.unwrap_or(*slot);
    }
}

/// Random numbers of a trial.
pub(super) struct Draw(pub ChaCha8Rng);

impl Draw {
    /// A Gaussian number.
    pub fn normal(&mut self, sd: f64) -> f64 {
        sd * self.0.sample::<f64, _>(StandardNormal)
    }

    /// A Gaussian vector.
    pub fn vector(&mut self, sd: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal(sd))
    }

    /// A uniform number.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        self.0.random_range(least..most)
    }

    /// A pose that looks along its z axis at a point from a random side, a metre or two away.
    pub fn looking_at(&mut self, point: &Vector3<f64>) -> Pose {
        let turned = Pose::new(self.vector(2.0), Vector3::zeros());
        Pose { translation: point - turned.rotation.column(2) * self.between(0.8, 2.5), ..turned }
    }
}
