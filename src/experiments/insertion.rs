//! Insertion: an object that is held anyhow goes into a hole that two features mark.
use super::manipulation::{ROBOT, Scene, approach, jitter};
use super::setting::{HELD_OUT, SETTING, columns, trials};
use super::{Experiment, Options, Outcome, Row};
use crate::Error;
use crate::simulate::world::Object;
use handeye_solvers::Pose;
use nalgebra::Vector3;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "insertion",
    about: "an inexact robot inserts an object into a hole that two features mark",
    source: "Gothoskar et al., figure 13, in words",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// An edge that is off by less than this goes in [m].
const TOLERANCE: f64 = 0.002;

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let columns = columns(&results);
    Ok(Outcome {
        setting: format!(
            "{SETTING}; {ROBOT}; 50 samples of the arm, 5 with the object as it is held: off by 1 cm and 10 degrees"
        ),
        measure: "the object's edges against the marks of the hole",
        abscissa: None,
        rows: vec![
            Row::new("farther edge off by, mm", None, &columns[0]),
            Row::new(format!("share within {} mm", 1e3 * TOLERANCE), None, &columns[1]),
            Row::new("one motion that leads nowhere, mm", None, &columns[2]),
        ],
        notes: vec![
            "on the way: 4 motions to the structure stretched by 1.4, then one each to 1.3, 1.2, 1.1 and 1.0"
                .to_owned(),
            "published: tight fits are inserted so, on a Baxter".to_owned(),
        ],
    })
}

fn trial(seed: u64) -> Result<Vec<Option<f64>>, Error> {
    let scene = Scene::new(seed)?;
    let failed = Ok(vec![None; 3]);
    let grip = Pose::new(Vector3::new(0.1, -0.1, 0.1), Vector3::new(0.005, 0.005, -0.007));
    let Some(arm) = scene.learn_arm(seed)? else { return failed };
    let Some(known) = scene.learn_object(&arm, &grip, seed ^ HELD_OUT)? else { return failed };
    let (mut world, place) = scene.world(seed)?;
    world.put(Object::held(scene.object(), grip));
    world.put(Object::new(scene.hole(), place));
    let edges = |name: &str| name.strip_prefix("hole").map(|number| format!("object{number}"));
    let named = |name: String| known.features.iter().position(|feature| feature.name == name);
    approach(&known, (&scene.object(), true), &mut world, &|name| edges(name).and_then(named))?;
    let off = |(edge, mark): (&usize, &usize)| (world.feature(*edge) - world.feature(*mark)).norm();
    let farther = scene.object().iter().zip(&scene.hole()).map(off).fold(0.0, f64::max);
    let floor = jitter(&mut world, &scene.middle())?;
    Ok([1e3 * farther, f64::from(u8::from(farther < TOLERANCE)), 1e3 * floor].map(Some).to_vec())
}
