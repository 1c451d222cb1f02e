//! Grasping: the structure is learned with the object in the hand, the target from the object's features alone.
use super::manipulation::{ROBOT, Scene, approach, jitter};
use super::setting::{HELD_OUT, SETTING, columns, trials};
use super::{Experiment, Options, Outcome, Row};
use crate::Error;
use crate::simulate::world::Object;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "grasping",
    about: "an inexact robot grasps an object whose structure was learned from 5 samples",
    source: "Gothoskar et al., figure 12, in words",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// A grasp that is off by less than this holds the object [m].
const TOLERANCE: f64 = 0.005;

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let columns = columns(&results);
    Ok(Outcome {
        setting: format!("{SETTING}; {ROBOT}; 50 samples of the arm, 5 with the object in the hand"),
        measure: "where the object is in the hand, against where it was learned",
        abscissa: None,
        rows: vec![
            Row::new("off by, mm", None, &columns[0]),
            Row::new("turned by, degrees", None, &columns[1]),
            Row::new(format!("share within {} mm", 1e3 * TOLERANCE), None, &columns[2]),
            Row::new("one motion that leads nowhere, mm", None, &columns[3]),
        ],
        notes: vec![
            "on the way: 4 motions to the structure stretched by 1.4, then one each to 1.3, 1.2, 1.1 and 1.0"
                .to_owned(),
            "published: grasping can be done consistently so, on a Baxter".to_owned(),
        ],
    })
}

fn trial(seed: u64) -> Result<Vec<Option<f64>>, Error> {
    let scene = Scene::new(seed)?;
    let failed = Ok(vec![None; 4]);
    let Some(arm) = scene.learn_arm(seed)? else { return failed };
    let Some(known) = scene.learn_object(&arm, &Pose::identity(), seed ^ HELD_OUT)? else { return failed };
    let (mut world, place) = scene.world(seed)?;
    let object = world.put(Object::new(scene.object(), place));
    let named = |name: &str| known.features.iter().position(|feature| feature.name == name);
    approach(&known, (&scene.object(), false), &mut world, &|name| named(name).filter(|_| name.starts_with("object")))?;
    let off = world.object(object).map_or_else(Pose::identity, |object| object.misplacement(&world.tip()));
    // Where the object itself is, 12 cm before the flange.
    let middle = scene.middle();
    let shift = (off.transform(&middle) - middle).norm();
    let turn = so3::log(&off.rotation).norm().to_degrees();
    let floor = jitter(&mut world, &middle)?;
    Ok([1e3 * shift, turn, f64::from(u8::from(shift < TOLERANCE)), 1e3 * floor].map(Some).to_vec())
}
