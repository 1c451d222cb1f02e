//! Figure 6: samples needed to learn a new base.
use super::graph::{Free, HELD};
use super::relearn::{Curve, Draw, rows};
use super::setting::{NOISE_NOTE, SETTING, rig};
use super::{Experiment, Options, Outcome};
use crate::Error;
use crate::recording::Recording;
use crate::rig::Model;
use handeye_solvers::Pose;
use handeye_solvers::nalgebra::Vector3;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure6",
    about: "samples needed to learn where the base was moved to",
    source: "Gothoskar et al., figure 6",
    trials: 60,
    is_timed: false,
    is_seeded: true,
    run,
};

/// How the base moved: a turn [rad] and a shift [m].
const TURN: [f64; 3] = [0.05, -0.03, 0.2];
const SHIFT: [f64; 3] = [0.05, -0.04, 0.02];

fn run(options: &Options) -> Result<Outcome, Error> {
    let mut truth = rig()?;
    let base = truth.robot.base.unwrap_or(Pose::identity());
    truth.robot.base = Some(base * Pose::new(Vector3::from(TURN), Vector3::from(SHIFT)));
    let free = Free { base: true, ..HELD };
    let curve = Curve { series: "new base", truth: &truth, free, draw: random_base, camera: None };
    Ok(Outcome {
        setting: format!("{SETTING}; chain, structure and cameras known, the base from random starts"),
        measure: "mean distance on held-out samples [px]",
        abscissa: Some("samples"),
        rows: rows(options, &curve)?,
        notes: vec![NOISE_NOTE.to_owned(), "published: learned with very few samples".to_owned()],
    })
}

/// Turned at random, about a metre or two in front of the first camera.
fn random_base(model: &Model, _: &Recording, draw: &mut Draw) -> Model {
    let mut model = model.clone();
    let camera = &model.cameras[0].pose;
    let ahead = camera.translation + camera.rotation.column(2) * draw.between(0.8, 2.5);
    model.base = Pose { translation: ahead + draw.vector(0.2), ..Pose::new(draw.vector(2.0), Vector3::zeros()) };
    model
}
