//! Table 7: the gradient of the loss over a buffer that fills with samples from after a camera was shifted.
use super::graph::{Free, Problem, Readings};
use super::setting::{SETTING, columns, learn, nothing, record, rig, thousandths, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;
use crate::rig::Model;
use handeye_solvers::Pose;
use handeye_solvers::nalgebra::Vector3;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table7",
    about: "norm of the gradient as samples of a shifted camera fill the buffer",
    source: "Gothoskar et al., table 7",
    trials: 50,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Mean and standard deviation with 0, 1, 2, ... of the samples from after the shift.
const PUBLISHED: [(f64, f64); 11] = [
    (40.618, 1.986),
    (945.384, 50.604),
    (1788.127, 73.690),
    (2666.490, 85.969),
    (3404.664, 93.083),
    (4287.491, 99.077),
    (5127.693, 111.578),
    (5930.182, 128.776),
    (6762.114, 125.875),
    (7630.604, 119.384),
    (8403.353, 121.102),
];

/// Samples in the buffer.
const BUFFER: usize = 50;

/// The series that shows the growth alone.
const SHARE: &str = "over that of 49/1";

/// How the camera moves in its own frame: a turn [rad] and a shift [m].
const TURN: [f64; 3] = [0.03, 0.03, 0.0];
const SHIFT: [f64; 3] = [0.02, 0.02, 0.0];

fn run(options: &Options) -> Result<Outcome, Error> {
    let truth = rig()?;
    let mut moved = truth.clone();
    let shift = Pose::new(Vector3::from(TURN), Vector3::from(SHIFT));
    moved.cameras[0].pose = truth.cameras[0].pose.map(|pose| pose * shift);
    let results = trials(options, |seed| {
        let training = record(&truth, BUFFER, seed)?;
        let Some(learned) = learn(&nothing(&truth), &training)? else { return Ok(vec![None; 2 * PUBLISHED.len()]) };
        let (model, after) = (Model::new(&learned.rig)?, record(&moved, PUBLISHED.len() - 1, seed)?);
        let free = Free { base: true, chain: true, features: true, cameras: &[0, 1], joints: Readings::Exact };
        let norm = |new: usize| -> Result<f64, Error> {
            let mut buffer = training.clone();
            for (old, new) in buffer.samples.iter_mut().rev().zip(&after.samples[..new]) {
                *old = new.clone();
            }
            let problem = Problem::new(&learned.rig, &model, &buffer, &free)?;
            let sigma = truth.noise.pixels;
            Ok(2.0 * sigma * sigma * problem.gradient_norm() / problem.detections as f64)
        };
        let norms = (0..PUBLISHED.len()).map(norm).collect::<Result<Vec<_>, Error>>()?;
        let shares = norms.iter().map(|norm| norm / norms[1]);
        Ok(norms.iter().copied().chain(shares).map(Some).collect())
    })?;
    let ours = columns(&results);
    let (norms, shares) = ours.split_at(PUBLISHED.len());
    let label = |new: usize, what: &str| format!("{what}, {}/{new}", BUFFER - new);
    let mut rows = Vec::new();
    for (new, (&(mean, sd), ours)) in PUBLISHED.iter().zip(norms).enumerate() {
        rows.push(Row::new(label(new, "norm"), Published::spread(mean, sd), ours).at("norm", new as f64));
    }
    for (new, (&(mean, _), ours)) in PUBLISHED.iter().zip(shares).enumerate() {
        let published = Published::single(thousandths(mean / PUBLISHED[1].0));
        rows.push(Row::new(label(new, SHARE), published, ours).at(SHARE, new as f64));
    }
    Ok(Outcome {
        setting: format!(
            "{SETTING}; learned from 50 samples, of which the last are replaced; camera turned by 2.4 degrees and shifted by 28 mm"
        ),
        measure: "norm of the gradient of the mean squared pixel distance [px²/(rad, m, px)]",
        abscissa: Some("samples after the shift"),
        rows,
        notes: vec![
            "the paper states neither the size of its shift nor how its loss is scaled: norms are comparable by how they grow"
                .to_owned(),
        ],
    })
}
