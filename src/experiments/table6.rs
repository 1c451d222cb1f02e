//! Table 6: the joints from one camera's image and from both, with a rig that was learned with both.
use super::graph::{Free, HELD, Problem, Readings};
use super::relearn::Draw;
use super::setting::{NOISE_NOTE, SETTING, columns, held_out, learn, mean_px, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;
use crate::recording::Recording;
use crate::rig::{Model, Rig};
use handeye_solvers::LevenbergMarquardt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table6",
    about: "joints inferred from one camera and from both",
    source: "Gothoskar et al., table 6",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Mean and standard deviation in simulation: joints [rad] from both and from one, reprojection [px] likewise.
const PUBLISHED: [(&str, f64, f64); 4] = [
    ("joints [rad], both cameras", 0.0536, 0.0134),
    ("joints [rad], one camera", 0.0519, 0.0095),
    ("reprojection [px], both cameras", 1.1441, 0.1450),
    ("reprojection [px], one camera", 1.6608, 0.2262),
];

/// How far the joints from which inference starts are off [rad].
const START: f64 = 0.1;

fn run(options: &Options) -> Result<Outcome, Error> {
    let truth = rig()?;
    let results = trials(options, |seed| {
        let Some(learned) = learn(&nothing(&truth), &record(&truth, 50, seed)?)? else { return Ok(vec![None; 4]) };
        let fresh = held_out(&truth, seed)?;
        let both = infer(&learned.rig, &fresh, |_| true, seed)?;
        let single = infer(&learned.rig, &fresh, |camera| camera == 0, seed)?;
        Ok(vec![Some(both[0]), Some(single[0]), Some(both[1]), Some(single[1])])
    })?;
    let row = |(&(label, mean, sd), ours): (&(&str, f64, f64), Vec<Option<f64>>)| {
        Row::new(label, Published::spread(mean, sd), &ours)
    };
    Ok(Outcome {
        setting: format!("{SETTING}; learned from 50 samples, joints of 100 others inferred"),
        measure: "mean norm of the joints' error [rad], mean distance in both images [px]",
        abscissa: None,
        rows: PUBLISHED.iter().zip(columns(&results)).map(row).collect(),
        notes: vec![
            NOISE_NOTE.to_owned(),
            format!("least squares over the joints, from {START} rad (standard deviation) beside the true ones"),
        ],
    })
}

/// Mean norm of the joints' error [rad], and mean pixel distance in all images of what the inferred joints predict.
fn infer(rig: &Rig, fresh: &Recording, sees: impl Fn(u32) -> bool, seed: u64) -> Result<[f64; 2], Error> {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
    let mut seen = fresh.clone();
    for sample in &mut seen.samples {
        sample.pixels.retain(|detection| sees(detection.camera));
        sample.joints.iter_mut().flatten().for_each(|joint| *joint += draw.normal(START));
    }
    let (model, free) = (Model::new(rig)?, Free { joints: Readings::Start, ..HELD });
    let mut predicted = fresh.clone();
    let mut sum = 0.0;
    for (index, sample) in predicted.samples.iter_mut().enumerate() {
        let mut problem = Problem::new(rig, &model, &seen.select(|other| other == index), &free)?;
        LevenbergMarquardt::default().minimize(&mut problem.graph)?;
        let Some(joints) = problem.joints().pop() else { continue };
        let true_joints = sample.joints.replace(joints.clone()).unwrap_or_default();
        sum += true_joints.iter().zip(&joints).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    }
    Ok([sum / fresh.samples.len() as f64, mean_px(rig, &predicted)?])
}
