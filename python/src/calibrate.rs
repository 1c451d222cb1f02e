//! `calibrate` and what it gives.
use crate::errors::{raise, unusable};
use crate::evaluate::by_camera;
use crate::recording::Recording;
use crate::rig::{AnyRig, Rig};
use crate::work;
use handeye::calibrate::{
    self as library, DeterminedBy, NoiseTrial, Options, Report, TargetReport as Targets, camera_poses_in_words,
    length_in_words,
};
use handeye::report::{About, Subject, html, suggestion};
use handeye::rig;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Arc;

/// The side of all tags [m], and its standard deviation.
#[derive(FromPyObject)]
pub enum TagSide {
    Alone(f64),
    WithDeviation(f64, f64),
}

/// Two ends, what was measured between them [m], and its standard deviation.
#[derive(FromPyObject)]
pub enum Length {
    WithDeviation(String, String, f64, f64),
    Alone(String, String, f64),
}

/// Learns what is unknown of a rig from a recording, and refines the rest.
///
/// rig: what is known; left out, everything is learned from the recording alone. relearn: paths of parameters to learn anew from few
/// samples while everything else is held, such as ``["cameras.left"]``. estimate_noise: the noise of pixels, points, joints, poses and
/// actions is estimated from the data. select_noise: the noise of joints or poses is picked by how well samples held out are predicted.
/// tag_side: the side of all tags whose corners are features [m], or that and its standard deviation. lengths: distances that were
/// measured between two features or two cameras, such as ``[("features.f0", "features.f7", 0.12)]`` [m], each with its standard deviation
/// as a fourth where it is known; 0.5 mm where not. eye_in_hand: cameras that the rig does not list are on the hand, and what they see
/// stands in the world. hold: parameters that stay at their values, such as ``["cameras.*.intrinsics"]``.
/// influence: what leaving out each sample would change is computed too. seed: the same seed gives the same rig, byte for byte.
/// progress: called with a ``Progress`` as the work goes on; what it raises ends the work, and so does Ctrl-C. threads: to work on, all
/// cores where left out; the result does not depend on it.
///
/// Where ``converged`` of the result is false, what was learned is not to be relied on.
///
/// Raises ``NotDone`` where the recording cannot determine the rig, naming what is missing, and ``UnusableInput`` where the two do not
/// fit together.
#[pyfunction]
#[pyo3(signature = (recording, rig = None, *, relearn = None, estimate_noise = false, select_noise = false, influence = false, seed = 1,
    tag_side = None, lengths = None, eye_in_hand = false, hold = None, progress = None, threads = None))]
#[expect(clippy::too_many_arguments, reason = "one keyword per option")]
pub fn calibrate(
    py: Python<'_>,
    recording: &Recording,
    rig: Option<AnyRig<'_>>,
    relearn: Option<Vec<String>>,
    estimate_noise: bool,
    select_noise: bool,
    influence: bool,
    seed: u64,
    tag_side: Option<TagSide>,
    lengths: Option<Vec<Length>>,
    eye_in_hand: bool,
    hold: Option<Vec<String>>,
    progress: Option<Py<PyAny>>,
    threads: Option<usize>,
) -> PyResult<Calibration> {
    let (mut before, text) = rig.map_or_else(Default::default, |rig| (rig.inner.clone(), rig.text.clone()));
    let (recording, notes) = (recording.inner.clone(), recording.notes.clone());
    if eye_in_hand && !library::put_on_tip(&mut before, &recording) {
        return Err(unusable("eye_in_hand: the rig lists every camera with its parent".to_owned()));
    }
    for pattern in hold.iter().flatten() {
        library::hold(&mut before, &recording, pattern).map_err(|problem| unusable(format!("hold: {problem}")))?;
    }
    let tag_side = tag_side.map(|side| match side {
        TagSide::Alone(side) => [side, rig::Length::RULER],
        TagSide::WithDeviation(side, sd) => [side, sd],
    });
    before.estimate.tag_side = tag_side.or(before.estimate.tag_side);
    for length in lengths.unwrap_or_default() {
        let (one, other, length, sd) = match length {
            Length::Alone(one, other, length) => (one, other, length, rig::Length::RULER),
            Length::WithDeviation(one, other, length, sd) => (one, other, length, sd),
        };
        let between =
            rig::Ends::new([&one, &other]).map_err(|problem| PyValueError::new_err(format!("lengths: {problem}")))?;
        before.estimate.measure(rig::Length { between, length, sd });
    }
    if relearn.is_some() && hold.as_ref().is_some_and(|hold| !hold.is_empty()) {
        return Err(unusable("hold: what is not learned anew with relearn is held already".to_owned()));
    }
    for (other, is_given) in [("relearn", relearn.is_some()), ("estimate_noise", estimate_noise)] {
        if select_noise && is_given {
            return Err(unusable(format!("select_noise: it picks what noise to learn with, and not with {other}")));
        }
    }
    let options = Options { seed, estimate_noise, influence, ..Options::default() };
    let (before, inner) = work::run(py, progress.as_ref(), threads, |observer| {
        if select_noise {
            let trials = library::select_noise(&before, &recording, &options, observer)?;
            before.noise = NoiseTrial::best(&trials).map_or(before.noise, |best| best.noise);
        }
        let learned = match &relearn {
            Some(paths) => library::relearn(&before, &recording, paths, &options, observer),
            None => library::calibrate(&before, &recording, &options, observer),
        };
        Ok((before, learned?))
    })?;
    Ok(Calibration { inner, before, text, recording, notes })
}

/// A learned rig and how it was learned.
#[pyclass(module = "handeye", frozen)]
pub struct Calibration {
    inner: library::Calibration,
    before: rig::Rig,
    text: Option<String>,
    recording: Arc<handeye::recording::Recording>,
    notes: Vec<String>,
}

impl Calibration {
    fn report(&self) -> &Report {
        &self.inner.report
    }
}

#[pymethods]
impl Calibration {
    /// The rig with every value filled in.
    #[getter]
    fn rig(&self) -> Rig {
        Rig { inner: self.inner.rig.clone(), text: self.text.clone() }
    }

    /// True where a minimum was reached.
    #[getter]
    fn converged(&self) -> bool {
        self.report().converged
    }

    /// Samples used.
    #[getter]
    fn samples(&self) -> usize {
        self.report().samples
    }

    /// Detections used.
    #[getter]
    fn observations(&self) -> usize {
        self.report().observations
    }

    /// Detections left out as wrong.
    #[getter]
    fn rejected(&self) -> usize {
        self.report().rejected
    }

    /// Root mean square of the pixel distances [px].
    #[getter]
    fn rms_px(&self) -> f64 {
        self.report().rms_px
    }

    /// Mean pixel distance [px].
    #[getter]
    fn mean_px(&self) -> f64 {
        self.report().mean_px
    }

    /// Median pixel distance [px].
    #[getter]
    fn median_px(&self) -> f64 {
        self.report().median_px
    }

    /// ``Errors`` by camera.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_camera(py, &self.report().cameras)
    }

    /// What was minimised, in order.
    #[getter]
    fn stages(&self) -> Vec<Stage> {
        let stage = |stage: &library::StageReport| {
            let library::StageReport { name, iterations, loss_before, loss_after, seconds } = stage.clone();
            Stage { name, iterations, loss_before, loss_after, seconds }
        };
        self.report().stages.iter().map(stage).collect()
    }

    /// What the data cannot determine, in words, and how it was fixed.
    #[getter]
    fn gauge(&self) -> Vec<String> {
        self.report().gauge.clone()
    }

    /// Where the robot's state is known from, in words: which readings and actions take part, and how well they are known.
    #[getter]
    fn states(&self) -> Vec<String> {
        self.report().states.clone()
    }

    /// Samples, images and cameras that do not fit, in words.
    #[getter]
    fn findings(&self) -> Vec<String> {
        self.report().findings.iter().map(ToString::to_string).collect()
    }

    /// Standard deviation of the tip's position over the recorded samples; ``None`` where the data leave the rig open.
    #[getter]
    fn tip(&self) -> Option<TipDeviation> {
        let tip = self.report().tip?;
        let library::TipDeviation { median, largest, by_data, sources, metric } = tip;
        let library::Sources { robot, cameras, features, lengths, .. } = sources;
        Some(TipDeviation { median, largest, by_data, robot, cameras, features, lengths, metric })
    }

    /// Standard deviations of what was learned, by parameter path: see ``Rig.deviations``.
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rig().into_pyobject(py)?.getattr("deviations")
    }

    /// Combinations of numbers that nothing, or a prior more than the data, determines; the weakest first.
    #[getter]
    fn weak(&self) -> Vec<Weak> {
        let weak = |weak: &library::Combination| Weak {
            numbers: weak.numbers.clone(),
            moves: weak.moves.clone(),
            determined_by: match weak.determined_by {
                DeterminedBy::Nothing => "nothing",
                DeterminedBy::Prior(_) => "prior",
                DeterminedBy::Poorly { .. } => "data, poorly",
            },
            tip: weak.tip,
            cure: weak.cure.clone(),
            text: weak.to_string(),
        };
        self.report().weak.iter().map(weak).collect()
    }

    /// What leaving out each sample would change, where ``influence`` was asked for.
    #[getter]
    fn influence(&self) -> Vec<Influence> {
        let one = |one: &library::Influence| {
            let library::Influence { sample, tip, rms_px, rms_points_m, misfit } = *one;
            Influence { sample, tip, rms_px, rms_points_m, misfit }
        };
        self.report().influence.iter().map(one).collect()
    }

    /// What was learned from targets, where these and not pixels were used; the pixel distances are 0 then.
    #[getter]
    fn targets(&self) -> Option<TargetReport> {
        let targets = self.report().targets.as_ref()?;
        Some(TargetReport {
            rms_xyz: targets.rms_xyz,
            rms_rot: targets.rms_rot,
            time_offset: targets.time_offset,
            scale: targets.scale,
            disagreements: targets.disagreements.iter().map(|one| (one.name.clone(), one.rot, one.xyz)).collect(),
        })
    }

    /// The report as one self-contained HTML page, which is written to a file. ``title`` stands at its top.
    #[pyo3(name = "report", signature = (path, title = None))]
    fn report_to(&self, py: Python<'_>, path: PathBuf, title: Option<&str>) -> PyResult<()> {
        let page = self.html(py, title)?;
        rig::replace_file(&path, |file| file.write_all(page.as_bytes())).map_err(raise)
    }

    /// The same page as text.
    #[pyo3(signature = (title = None))]
    fn html(&self, py: Python<'_>, title: Option<&str>) -> PyResult<String> {
        let page = || {
            let suggestion = suggestion(&self.inner.rig, &self.recording, &self.before);
            html(&Subject {
                about: About { title: title.unwrap_or("A learned rig"), command: "", notes: &self.notes },
                before: &self.before,
                calibration: &self.inner,
                recording: &self.recording,
                tables: &[],
                suggestion: suggestion.as_ref(),
            })
        };
        py.detach(page).map_err(raise)
    }

    fn __repr__(&self) -> String {
        let report = self.report();
        let converged = if report.converged { "" } else { ", NOT CONVERGED" };
        let fit = match &report.targets {
            Some(targets) => format!("{:.3} mm and {:.4}° rms", 1e3 * targets.rms_xyz, targets.rms_rot.to_degrees()),
            None => format!("{:.3} px rms", report.rms_px),
        };
        format!(
            "<handeye.Calibration {} samples, {} detections, {fit}{converged}>",
            report.samples, report.observations
        )
    }

    /// What a person wants to know first.
    fn __str__(&self) -> String {
        let report = self.report();
        let mut lines = vec![self.__repr__().trim_matches(['<', '>']).trim_start_matches("handeye.").to_owned()];
        if let Some(tip) = &report.tip {
            lines.push(format!("the tip's position is known to {tip}"));
        }
        lines.extend(camera_poses_in_words(&self.inner));
        for (title, list) in [
            ("left open by the data", &report.gauge),
            ("the robot's state", &report.states),
            ("of targets", &report.targets.as_ref().map_or_else(Vec::new, Targets::remarks)),
            ("does not fit", &self.findings()),
        ] {
            lines.extend(list.iter().map(|line| format!("{title}: {line}")));
        }
        lines.join("\n")
    }
}

/// One stage of a calibration.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct Stage {
    /// Its name.
    name: String,
    /// Iterations of the minimiser, over all starts.
    iterations: usize,
    /// Loss before.
    loss_before: f64,
    /// Loss after.
    loss_after: f64,
    /// How long it took [s].
    seconds: f64,
}

#[pymethods]
impl Stage {
    fn __repr__(&self) -> String {
        let Stage { name, iterations, loss_before, loss_after, .. } = self;
        format!("<handeye.Stage {name}: {iterations} iterations, loss {loss_before:.4e} -> {loss_after:.4e}>")
    }
}

/// Standard deviation of the tip's position over the recorded samples [m, or the model's unit where nothing metric is known].
#[pyclass(module = "handeye", frozen, get_all)]
pub struct TipDeviation {
    /// Median over the samples.
    median: f64,
    /// Largest over the samples.
    largest: f64,
    /// What errors of the recording account for, of the median: the squares of this and the next four add up to its square.
    by_data: f64,
    /// What errors of the robot's numbers as they were given account for.
    robot: f64,
    /// What errors of cameras' poses and lenses as they were given account for.
    cameras: f64,
    /// What errors of features as they were given account for.
    features: f64,
    /// What errors of lengths that were measured account for, sides of tags among them.
    lengths: f64,
    /// True where it is in metres.
    metric: bool,
}

#[pymethods]
impl TipDeviation {
    fn __repr__(&self) -> String {
        let length = |length| length_in_words(length, self.metric);
        let [median, largest, by_data] = [self.median, self.largest, self.by_data].map(length);
        format!("<handeye.TipDeviation median {median}, largest {largest}; {by_data} by the data alone>")
    }
}

/// Numbers of a rig that can move together without the data objecting much.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct Weak {
    /// Parameter paths and how far each moves, in its own unit; the largest first and 1.
    numbers: Vec<(String, f64)>,
    /// What moves together, in words: the largest parts, and how many smaller ones there are.
    moves: String,
    /// ``"nothing"``, ``"prior"`` (more than the data) or ``"data, poorly"``.
    determined_by: &'static str,
    /// Standard deviation of the tip's position that comes of it [m, or the model's unit]; ``None`` where nothing bounds it.
    tip: Option<f64>,
    /// What would determine it at the least expense; empty where nothing that can be seen would.
    cure: String,
    /// All of it in words.
    text: String,
}

#[pymethods]
impl Weak {
    fn __repr__(&self) -> String {
        format!("<handeye.Weak {}>", self.text)
    }
}

/// What leaving out a sample would change, and how well it fits.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct Influence {
    /// Index of the sample, from 0.
    sample: usize,
    /// How far the tip would move, root mean square over the samples [m, or the model's unit].
    tip: Option<f64>,
    /// Root mean square pixel distance of its detections [px].
    rms_px: f64,
    /// Root mean square distance of its points [m].
    rms_points_m: f64,
    /// Root mean square of all its errors, by coordinate [standard deviations].
    misfit: f64,
}

#[pymethods]
impl Influence {
    fn __repr__(&self) -> String {
        let Influence { sample, tip, misfit, .. } = self;
        let tip = tip.map_or(String::new(), |tip| format!("moves the tip by {tip:.2e}, "));
        format!("<handeye.Influence of sample {sample}: {tip}misfit {misfit:.2}>")
    }
}

/// What was learned from targets.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct TargetReport {
    /// Root mean square of the translations' misfits, per axis [m].
    rms_xyz: f64,
    /// The same of the rotations [rad].
    rms_rot: f64,
    /// How far the clock of the images is ahead of the robot's, and its standard deviation [s], where they were recorded apart.
    time_offset: Option<(f64, f64)>,
    /// Factor of the reported translations and its standard deviation, where it is not 1.
    scale: Option<(f64, f64)>,
    /// Closed forms that are far from what was learned: name, angle [rad], distance [m].
    disagreements: Vec<(String, f64, f64)>,
}

#[pymethods]
impl TargetReport {
    fn __repr__(&self) -> String {
        let [mm, degrees] = [1e3 * self.rms_xyz, self.rms_rot.to_degrees()];
        format!("<handeye.TargetReport {mm:.3} mm and {degrees:.4}° rms>")
    }
}
