//! Table 5: how well a rig is learned from few samples.
use super::setting::{NOISE_NOTE, SETTING, columns, held_out, learn, mean_px, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table5",
    about: "error on held-out samples after learning from 30 to 70",
    source: "Gothoskar et al., table 5",
    trials: 50,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Samples, and mean and standard deviation in simulation [px].
const PUBLISHED: [(usize, f64, f64); 5] =
    [(30, 49.3582, 43.5229), (40, 3.2066, 2.3041), (50, 0.6235, 0.0143), (60, 0.6168, 0.0082), (70, 0.5991, 0.0082)];

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let results = trials(options, |seed| {
        let (recording, fresh) = (record(&rig, 100, seed)?, held_out(&rig, seed)?);
        let few = |&(samples, ..): &(usize, f64, f64)| match learn(
            &nothing(&rig),
            &recording.select(|index| index < samples),
        )? {
            Some(learned) => Ok(Some(mean_px(&learned.rig, &fresh)?)),
            None => Ok(None),
        };
        PUBLISHED.iter().map(few).collect::<Result<Vec<_>, Error>>()
    })?;
    let row = |(&(samples, mean, sd), ours): (&(usize, f64, f64), Vec<Option<f64>>)| {
        Row::new(format!("{samples} samples"), Published::spread(mean, sd), &ours).at("", samples as f64)
    };
    Ok(Outcome {
        setting: format!("{SETTING}; nothing known; 100 held-out samples"),
        measure: "mean distance on held-out samples [px]",
        abscissa: Some("training samples"),
        rows: PUBLISHED.iter().zip(columns(&results)).map(row).collect(),
        notes: vec![NOISE_NOTE.to_owned()],
    })
}
