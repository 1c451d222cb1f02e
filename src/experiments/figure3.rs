//! Figure 3: where training reaches a fraction of a pixel, so does the test.
use super::setting::{NOISE_NOTE, SETTING, held_out, learn, mean_px, nothing, record, rig, trials};
use super::{Experiment, Options, Outcome, Row};
use crate::Error;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure3",
    about: "error on held-out samples against error on training samples",
    source: "Gothoskar et al., figure 3",
    trials: 50,
    is_timed: false,
    is_seeded: true,
    run,
};

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let results = trials(options, |seed| {
        let recording = record(&rig, 50, seed)?;
        let Some(learned) = learn(&nothing(&rig), &recording)? else { return Ok(None) };
        Ok(Some([mean_px(&learned.rig, &recording)?, mean_px(&learned.rig, &held_out(&rig, seed)?)?]))
    })?;
    let mut pairs: Vec<[f64; 2]> = results.iter().flatten().copied().collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut rows: Vec<Row> = pairs
        .iter()
        .map(|[train, test]| Row::new(format!("training at {train:.3} px"), None, &[Some(*test)]).at("", *train))
        .collect();
    let tests: Vec<Option<f64>> = results.iter().map(|pair| pair.map(|[_, test]| test)).collect();
    rows.push(Row::new("all trials", None, &tests));
    let subpixel: Vec<[f64; 2]> = pairs.into_iter().filter(|[train, _]| *train < 1.0).collect();
    let follows = subpixel.iter().filter(|[_, test]| *test < 1.0).count();
    Ok(Outcome {
        setting: format!("{SETTING}; 50 samples, nothing known; 100 held-out samples"),
        measure: "mean distance on held-out samples [px]",
        abscissa: Some("mean distance on training samples [px]"),
        rows,
        notes: vec![
            NOISE_NOTE.to_owned(),
            format!(
                "published: where training converges to sub-pixel values, the test does as well; ours: in {follows} of {}",
                subpixel.len()
            ),
        ],
    })
}
