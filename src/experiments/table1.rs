//! Table 1: the loss before and after all parameters are learned together.
use super::setting::{NOISE_NOTE, SETTING, columns, learn, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table1",
    about: "pixel error before and after all parameters are learned together",
    source: "Gothoskar et al., table 1",
    trials: 50,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Simulation, before and after.
const PUBLISHED: [f64; 2] = [414.21, 0.47];

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let results = trials(options, |seed| {
        let Some(learned) = learn(&nothing(&rig), &record(&rig, 50, seed)?)? else { return Ok(vec![None; 2]) };
        let report = &learned.report;
        // Losses are Σ ρ(|r/σ|²)/2 over all detections.
        let rms = |loss: f64| rig.noise.pixels * (2.0 * loss / report.observations as f64).sqrt();
        let mut together = report.stages.iter().filter(|stage| stage.name.starts_with("end to end"));
        let before = together.next().map(|stage| rms(stage.loss_before));
        Ok(vec![before, report.stages.last().map(|stage| rms(stage.loss_after))])
    })?;
    let labels = ["before end to end", "after end to end"];
    let rows = labels.iter().zip(PUBLISHED).zip(columns(&results));
    Ok(Outcome {
        setting: format!("{SETTING}; 50 samples, nothing known"),
        measure: "robust rms [px]",
        abscissa: None,
        rows: rows.map(|((label, published), ours)| Row::new(*label, Published::single(published), &ours)).collect(),
        notes: vec![
            NOISE_NOTE.to_owned(),
            "ours is the loss of the stages as a pixel distance: before is after cameras, structure and chain were learned one \
             after the other and their frames were joined"
                .to_owned(),
        ],
    })
}
