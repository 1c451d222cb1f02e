//! Figure 5: samples needed to learn a new structure.
use super::graph::{Free, HELD};
use super::relearn::{Curve, Draw, rows};
use super::setting::{NOISE_NOTE, SETTING, rig};
use super::{Experiment, Options, Outcome};
use crate::Error;
use crate::recording::Recording;
use crate::rig::Model;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure5",
    about: "samples needed to learn where new features are",
    source: "Gothoskar et al., figure 5",
    trials: 60,
    is_timed: false,
    is_seeded: true,
    run,
};

fn run(options: &Options) -> Result<Outcome, Error> {
    let truth = rig()?;
    let free = Free { features: true, ..HELD };
    let curve = Curve { series: "new structure", truth: &truth, free, draw: random_features, camera: None };
    Ok(Outcome {
        setting: format!("{SETTING}; robot and cameras known, the features from random starts"),
        measure: "mean distance on held-out samples [px]",
        abscissa: Some("samples"),
        rows: rows(options, &curve)?,
        notes: vec![NOISE_NOTE.to_owned(), "published: with 2 samples very close to maximum precision".to_owned()],
    })
}

/// Within some 10 cm of the tip.
fn random_features(model: &Model, _: &Recording, draw: &mut Draw) -> Model {
    let mut model = model.clone();
    model.features.iter_mut().for_each(|feature| feature.xyz = draw.vector(0.1));
    model
}
