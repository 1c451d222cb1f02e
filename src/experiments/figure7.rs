//! Figure 7: samples needed to learn the kinematics, and to learn everything.
use super::setting::{NOISE_NOTE, SETTING, columns, held_out, learn, mean_px, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Row};
use crate::Error;
use crate::rig::Rig;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure7",
    about: "samples needed to learn the kinematics, and to learn everything",
    source: "Gothoskar et al., figure 7",
    trials: 60,
    is_timed: false,
    is_seeded: true,
    run,
};

const SAMPLES: [usize; 8] = [8, 10, 12, 15, 20, 30, 40, 50];

fn run(options: &Options) -> Result<Outcome, Error> {
    let truth = rig()?;
    let mut rows = curve(options, &truth, &without_kinematics(&truth), "kinematics")?;
    rows.extend(curve(options, &truth, &nothing(&truth), "from scratch")?);
    Ok(Outcome {
        setting: format!("{SETTING}; kinematics: the cameras held and the chain unknown; from scratch: nothing known"),
        measure: "mean distance on held-out samples [px]",
        abscissa: Some("samples"),
        rows,
        notes: vec![
            NOISE_NOTE.to_owned(),
            "published: kinematics take significantly more samples than cameras or structure".to_owned(),
            "a tip without a chain is known up to its frame: the structure is learned along with the kinematics"
                .to_owned(),
        ],
    })
}

fn curve(options: &Options, truth: &Rig, known: &Rig, series: &'static str) -> Result<Vec<Row>, Error> {
    let results = trials(options, |seed| {
        let (recording, fresh) = (record(truth, SAMPLES[SAMPLES.len() - 1], seed)?, held_out(truth, seed)?);
        let few = |&samples: &usize| match learn(known, &recording.select(|index| index < samples))? {
            Some(learned) => Ok(Some(mean_px(&learned.rig, &fresh)?)),
            None => Ok(None),
        };
        SAMPLES.iter().map(few).collect::<Result<Vec<_>, Error>>()
    })?;
    let row = |(samples, ours): (usize, Vec<Option<f64>>)| {
        Row::new(format!("{series}, {samples} samples"), None, &ours).at(series, samples as f64)
    };
    Ok(SAMPLES.into_iter().zip(columns(&results)).map(row).collect())
}

/// The cameras, held exactly.
fn without_kinematics(truth: &Rig) -> Rig {
    let mut known = nothing(truth);
    known.cameras = truth.cameras.clone();
    known.estimate.fixed = vec!["cameras.*".to_owned()];
    known
}
