//! Figure 8: pixel error against servoing commands, with a learned rig.
use super::servoing::{Acts, FLOOR_NOTE, TARGETS, rows, servo};
use super::setting::{NOISE_NOTE, SETTING, learn, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Published};
use crate::Error;
use crate::servo::ModelBased;
use crate::simulate::world::Execution;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure8",
    about: "servoing with a learned rig: pixel error after each command",
    source: "Gothoskar et al., figure 8, whose curve has no numbers; these are ViSP's",
    trials: 10,
    is_timed: false,
    is_seeded: true,
    run,
};

const COMMANDS: usize = 5;

/// Mean error of ViSP's vpServo, the best of 11 gains and 10 variants, on 100 pairs within ±0.6 rad of a UR5 before two cameras [px].
const VISP: [Option<f64>; COMMANDS + 1] = [Some(107.3), Some(57.4), Some(29.9), Some(15.5), None, Some(4.1)];

fn run(options: &Options) -> Result<Outcome, Error> {
    let truth = rig()?;
    let results = trials(options, |seed| {
        let Some(learned) = learn(&nothing(&truth), &record(&truth, 50, seed)?)? else { return Ok(None) };
        let robot = (&Execution::default(), Some(0.0), Acts::Joints);
        servo(&truth, &learned.rig, robot, (seed, COMMANDS), || ModelBased::new(&learned.rig)).map(Some)
    })?;
    Ok(Outcome {
        setting: format!(
            "{SETTING}; a rig learned from 50 samples, then {TARGETS} random targets a trial, seen with the same noise"
        ),
        measure: "true mean distance from the target [px]",
        abscissa: Some("commands"),
        rows: rows("ours", |step| VISP[step].and_then(Published::single), &results, COMMANDS),
        notes: vec![
            NOISE_NOTE.to_owned(),
            FLOOR_NOTE.to_owned(),
            "published: fewer steps and a lower final error than ViSP's vpServo; one step with a perfect model"
                .to_owned(),
            "ViSP knew the true rig and true depths; on its own 100 cases: cargo bench --bench servo".to_owned(),
        ],
    })
}
