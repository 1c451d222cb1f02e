//! Table 4: k-fold cross-validation.
use super::setting::{NOISE_NOTE, SETTING, learn, mean_px, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table4",
    about: "k-fold cross-validation on 200 samples",
    source: "Gothoskar et al., table 4",
    trials: 10,
    is_timed: false,
    is_seeded: true,
    run,
};

/// k, and mean and standard deviation in simulation [px].
const PUBLISHED: [(usize, f64, f64); 5] =
    [(2, 0.5600, 0.0205), (3, 0.5502, 0.0417), (4, 0.5577, 0.0663), (5, 0.6368, 0.2268), (6, 0.5445, 0.0667)];

/// Samples that are divided.
const SAMPLES: usize = 200;

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let results = trials(options, |seed| {
        let recording = record(&rig, SAMPLES, seed)?;
        let fold = |k: usize, fold: usize| match learn(&nothing(&rig), &recording.select(|index| index % k != fold))? {
            Some(learned) => Ok(Some(mean_px(&learned.rig, &recording.select(|index| index % k == fold))?)),
            None => Ok(None),
        };
        let folds =
            |&(k, ..): &(usize, f64, f64)| (0..k).map(|index| fold(k, index)).collect::<Result<Vec<_>, Error>>();
        PUBLISHED.iter().map(folds).collect::<Result<Vec<_>, Error>>()
    })?;
    let row = |(index, &(k, mean, sd)): (usize, &(usize, f64, f64))| {
        let ours: Vec<Option<f64>> = results.iter().flat_map(|trial| trial[index].iter().copied()).collect();
        let train = SAMPLES - SAMPLES.div_ceil(k);
        Row::new(format!("{k} folds, {train} to train"), Published::spread(mean, sd), &ours).at("", k as f64)
    };
    Ok(Outcome {
        setting: format!("{SETTING}; {SAMPLES} samples, nothing known; one figure per fold"),
        measure: "mean distance on the fold left out [px]",
        abscissa: Some("folds"),
        rows: PUBLISHED.iter().enumerate().map(row).collect(),
        notes: vec![NOISE_NOTE.to_owned()],
    })
}
