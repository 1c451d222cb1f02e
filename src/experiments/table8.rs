//! Table 8: learning from noisy joint readings, with the noise modelled and without.
use super::graph::{Free, Problem, Readings, with_model};
use super::setting::{HELD_OUT, SETTING, columns, learn, mean_px, nothing, record, rig, thousandths, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;
use crate::calibrate::evaluate;
use crate::recording::Recording;
use crate::rig::{Model, Rig};
use crate::simulate::{SimulateOptions, simulate};
use handeye_solvers::LevenbergMarquardt;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table8",
    about: "error after learning from noisy joint readings, with and without the noise modelled",
    source: "Gothoskar et al., table 8",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// One block of the table: standard deviation of the readings [rad]; mean and standard deviation of the errors [px].
struct Block {
    sd: f64,
    plain: [(f64, f64); 2],
    modelled: [(f64, f64); 2],
}

/// Error on training and on test samples.
const PUBLISHED: [Block; 3] = [
    Block { sd: 0.01, plain: [(1.484, 0.061), (1.715, 0.086)], modelled: [(1.218, 0.088), (1.394, 0.109)] },
    Block { sd: 0.02, plain: [(3.037, 0.153), (3.393, 0.211)], modelled: [(2.133, 0.272), (2.298, 0.274)] },
    Block { sd: 0.03, plain: [(5.185, 0.347), (6.077, 0.453)], modelled: [(3.859, 0.532), (4.434, 0.635)] },
];

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let mut rows = Vec::new();
    for block in &PUBLISHED {
        let results = trials(options, |seed| trial(&rig, block.sd, seed))?;
        let ours = columns(&results);
        let row = |what: &str, published, column: usize| {
            Row::new(format!("{} rad, {what}", block.sd), published, &ours[column])
        };
        let of = |(mean, sd): (f64, f64)| Published::spread(mean, sd);
        rows.push(row("noise ignored, training", of(block.plain[0]), 0));
        rows.push(row("noise ignored, test", of(block.plain[1]), 1));
        rows.push(row("noise modelled, training", of(block.modelled[0]), 2));
        rows.push(row("noise modelled, test", of(block.modelled[1]), 3));
        let ratio = thousandths(block.modelled[1].0 / block.plain[1].0);
        rows.push(row("test, modelled over ignored", Published::single(ratio), 4));
    }
    Ok(Outcome {
        setting: format!("{SETTING}; 100 samples, nothing known; 100 held-out samples without noise"),
        measure: "mean distance [px], and a ratio",
        abscissa: None,
        rows,
        notes: vec![
            "training errors are those at the noisy readings".to_owned(),
            "ignored: least squares with the readings for exact (eq. 7), started near the minimum; modelled: calibrate with [noise] joints"
                .to_owned(),
            "the paper picks the weight λ of the readings on a validation set; here it is the stated noise".to_owned(),
        ],
    })
}

/// Training and test error without the noise modelled, with it, and the ratio of the test errors.
fn trial(rig: &Rig, sd: f64, seed: u64) -> Result<Vec<Option<f64>>, Error> {
    let mut noisy = rig.clone();
    noisy.noise.joints = sd;
    let training = record(&noisy, 100, seed)?;
    let exact = SimulateOptions { samples: 100, seed: seed ^ HELD_OUT, ..SimulateOptions::default() };
    let test = simulate(rig, &exact)?.truth;
    // Who takes readings for exact sees the pixels scatter by as much as the noisy joints move them.
    let mut known = nothing(rig);
    known.noise.pixels = evaluate(rig, &training)?.total.rms_px / 2.0_f64.sqrt();
    let (Some(first), Some(modelled)) = (learn(&known, &training)?, learn(&nothing(&noisy), &training)?) else {
        return Ok(vec![None; 5]);
    };
    let plain = fit(&Rig { noise: rig.noise, ..first.rig }, &training)?;
    let modelled = modelled.rig;
    let [before, after] = [mean_px(&plain, &test)?, mean_px(&modelled, &test)?];
    let at_readings = [mean_px(&plain, &training)?, mean_px(&modelled, &training)?];
    Ok([at_readings[0], before, at_readings[1], after, after / before].map(Some).to_vec())
}

/// Least squares over everything, with readings that are exact (eq. 7).
fn fit(rig: &Rig, training: &Recording) -> Result<Rig, Error> {
    let mut model = Model::new(rig)?;
    let free = Free { base: false, chain: true, features: true, cameras: &[0, 1], joints: Readings::Exact };
    let mut problem = Problem::new(rig, &model, training, &free)?;
    LevenbergMarquardt { max_iterations: 300, ..LevenbergMarquardt::default() }.minimize(&mut problem.graph)?;
    problem.read(&mut model);
    Ok(with_model(rig, &model))
}
