//! Distances that were measured: what they tell of the scale, their factors, and whether the learned rig agrees.
use super::Finding;
use super::graph::{Built, State};
use super::setup::Setup;
use crate::Error;
use crate::factors::{OriginDistance, PointDistance};
use crate::rig::{Ends, Length, Model, Rig};
use handeye_solvers::Loss;

/// A length whose ends are found: two features or two cameras, by index.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Found {
    Features([usize; 2]),
    Cameras([usize; 2]),
}

/// A measured length that the learned rig misses by more than this is told [standard deviations].
const MISSED: f64 = 3.0;

impl Found {
    /// Errors: [`Error::Unusable`] where neither rig nor recording has one of the ends, or their distance is none of the rig's.
    pub fn new(rig: &Rig, length: &Length) -> Result<Found, Error> {
        let features: Vec<_> = rig.features.iter().map(|feature| (feature.name.as_str(), feature.parent)).collect();
        let cameras: Vec<_> = rig.cameras.iter().map(|camera| (camera.name.as_str(), camera.parent)).collect();
        let (known, of): (_, fn([usize; 2]) -> Found) = match length.between {
            Ends::Features(_) => (features, Found::Features),
            Ends::Cameras(_) => (cameras, Found::Cameras),
        };
        let (_, names) = length.between.parts();
        let index = |end: &String| known.iter().position(|(name, _)| name == end);
        match (length.between.problem(&known), index(&names[0]), index(&names[1])) {
            (None, Some(one), Some(other)) => Ok(of([one, other])),
            (problem, ..) => Err(Error::Unusable(format!("`lengths` of [estimate]: {}", problem.unwrap_or_default()))),
        }
    }

    fn now(self, model: &Model) -> f64 {
        match self {
            Found::Features([one, other]) => (model.features[one].xyz - model.features[other].xyz).norm(),
            Found::Cameras([one, other]) => {
                (model.cameras[one].pose.translation - model.cameras[other].pose.translation).norm()
            }
        }
    }
}

fn all(setup: &Setup) -> impl Iterator<Item = (&Length, Found)> {
    setup.rig.estimate.lengths.iter().zip(setup.lengths.iter().copied())
}

/// What all lengths of a state have to be multiplied by so that those that were measured come out best; `None` where none was.
pub(crate) fn scale(setup: &Setup, state: &State) -> Option<f64> {
    let (mut wanted, mut now) = (0.0, 0.0);
    for (length, found) in all(setup) {
        let weighted = found.now(&state.model) / length.sd;
        (wanted, now) = (wanted + weighted * length.length / length.sd, now + weighted * weighted);
    }
    let by = wanted / now;
    (by > 0.0 && by.is_finite()).then_some(by)
}

/// Adds a factor for each.
pub(crate) fn measure(setup: &Setup, loss: Loss, built: &mut Built) {
    for (&Length { length, sd, .. }, found) in all(setup) {
        match found {
            Found::Features([one, other]) => {
                let on = (built.features[one], built.features[other]);
                built.graph.factor(PointDistance { length }, on).sigma(sd).loss(loss);
            }
            Found::Cameras([one, other]) => {
                let on = (built.cameras[one].0, built.cameras[other].0);
                built.graph.factor(OriginDistance { length }, on).sigma(sd).loss(loss);
            }
        }
    }
}

/// Those that the learned rig misses.
pub(crate) fn missed(setup: &Setup, state: &State) -> impl Iterator<Item = Finding> {
    all(setup).filter_map(|(length, found)| {
        let learned = found.now(&state.model);
        ((learned - length.length).abs() > MISSED * length.sd)
            .then(|| Finding::MissedLength { length: length.clone(), learned })
    })
}
