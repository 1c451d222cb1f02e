//! Table 2: what learning in stages is for.
use super::graph::{Free, Problem, Readings, with_model};
use super::relearn::Draw;
use super::setting::{NOISE_NOTE, SETTING, columns, learn, mean_px, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;
use crate::recording::Recording;
use crate::rig::{Model, Rig};
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{Lbfgs, LevenbergMarquardt, Pose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table2",
    about: "pixel error after learning all at once, and in stages",
    source: "Gothoskar et al., table 2",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Simulation: all; cameras and structure, all; cameras and structure, kinematics, all.
const PUBLISHED: [f64; 3] = [549.4, 27077.9, 0.47];

/// Iterations in the paper.
const ITERATIONS: usize = 600;

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let results = trials(options, |seed| {
        let recording = record(&rig, 50, seed)?;
        let draw = &mut Draw(ChaCha8Rng::seed_from_u64(seed));
        let mut start = Model::new(&rig)?;
        random_chain(&mut start, draw);
        let with_structure = together(&rig, &start, &recording)?;
        random_sight(&mut start, draw);
        let all = together(&rig, &start, &recording)?;
        let staged = match learn(&nothing(&rig), &recording)? {
            Some(learned) => Some(mean_px(&learned.rig, &recording)?),
            None => None,
        };
        Ok(vec![all, with_structure, staged])
    })?;
    let labels = ["all at once", "cameras + structure, then all", "cameras + structure, kinematics, then all"];
    let rows = labels.iter().zip(PUBLISHED).zip(columns(&results));
    Ok(Outcome {
        setting: format!("{SETTING}; 50 samples"),
        measure: "mean distance on the training samples [px]",
        abscissa: None,
        rows: rows.map(|((label, published), ours)| Row::new(*label, Published::single(published), &ours)).collect(),
        notes: vec![
            NOISE_NOTE.to_owned(),
            format!(
                "the first two start at random and take {ITERATIONS} iterations of L-BFGS, as the paper's; the second starts \
                 with the true cameras and structure, the best that their stage could give"
            ),
        ],
    })
}

/// Everything is free but the base, which the cameras make up for.
fn together(rig: &Rig, start: &Model, recording: &Recording) -> Result<Option<f64>, Error> {
    let free = Free { base: false, chain: true, features: true, cameras: &[0, 1], joints: Readings::Exact };
    let mut problem = Problem::new(rig, start, recording, &free)?;
    let minimizer = Lbfgs { max_iterations: ITERATIONS, ..Lbfgs::default() };
    if minimizer.minimize(&mut problem.graph).is_err() {
        // A line search can leave what is finite; a damped method does not.
        problem = Problem::new(rig, start, recording, &free)?;
        let minimizer = LevenbergMarquardt { max_iterations: ITERATIONS, ..LevenbergMarquardt::default() };
        if minimizer.minimize(&mut problem.graph).is_err() {
            return Ok(None);
        }
    }
    let mut learned = start.clone();
    problem.read(&mut learned);
    Ok(Some(mean_px(&with_model(rig, &learned), recording)?).filter(|error| error.is_finite()))
}

/// Any angles, lengths of an arm.
fn random_chain(model: &mut Model, draw: &mut Draw) {
    for row in model.parameters.chunks_exact_mut(5) {
        row[0] = draw.between(-PI, PI);
        row[1] = draw.between(-0.5, 0.5);
        row[2] = draw.between(-0.5, 0.5);
        row[3] = draw.between(-PI, PI);
    }
}

/// Cameras that look at the origin from anywhere, features within some 10 cm of the tip.
fn random_sight(model: &mut Model, draw: &mut Draw) {
    for camera in &mut model.cameras {
        let pose: Pose = draw.looking_at(&Vector3::zeros());
        camera.pose = pose;
    }
    model.features.iter_mut().for_each(|feature| feature.xyz = draw.vector(0.1));
}
