//! Distances that were measured: what they tell of the scale, their factors, and whether the learned rig agrees.
use super::Finding;
use super::graph::{Built, State};
use super::setup::Setup;
use crate::Error;
use crate::factors::{OriginDistance, PointDistance};
use crate::rig::{Ends, Estimate, Feature, Length, Model, Rig};
use handeye_solvers::Loss;
use std::f64::consts::SQRT_2;

/// The ends of a length, found: two features or two cameras, by index.
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
        let known = length.between.among(rig);
        let of: fn([usize; 2]) -> Found = match length.between {
            Ends::Features(_) => Found::Features,
            Ends::Cameras(_) => Found::Cameras,
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

/// Everything that was measured, with its ends.
///
/// Errors: those of [`Found::new`], and [`Error::Unusable`] where a number is not what it may be, or the side of tags is given and there are none.
pub(crate) fn find(rig: &Rig) -> Result<Vec<(Length, Found)>, Error> {
    let mut numbers = rig.estimate.lengths.iter().flat_map(|length| [length.length, length.sd]);
    if let Some(wrong) = numbers.find(|number| !(*number > 0.0 && number.is_finite())) {
        return Err(Error::Unusable(format!("`lengths` of [estimate] are above 0, found {wrong} m")));
    }
    if let Some(problem) = rig.estimate.tag_side.and_then(Estimate::problem_of_tag_side) {
        return Err(Error::Unusable(format!("`tag_side` of [estimate]: {problem}")));
    }
    let given = rig.estimate.lengths.iter().map(|length| Ok((length.clone(), Found::new(rig, length)?)));
    let mut found: Vec<(Length, Found)> = given.collect::<Result<_, Error>>()?;
    if let Some(side) = rig.estimate.tag_side {
        let tags = tags(rig);
        found.extend(tags.iter().flat_map(|tag| sides_and_diagonals(rig, *tag, side, tags.len())));
        if tags.is_empty() {
            return Err(Error::Unusable(
                "`tag_side` of [estimate]: no tag has its four corners, FAMILY:ID/0 to FAMILY:ID/3, among the features"
                    .to_owned(),
            ));
        }
    }
    Ok(found)
}

/// The corners of every tag.
pub(crate) fn tags(rig: &Rig) -> Vec<[usize; 4]> {
    (0..rig.features.len()).filter_map(|first| corners(rig, first)).collect()
}

/// The corners of the tag whose first one this feature is.
fn corners(rig: &Rig, first: usize) -> Option<[usize; 4]> {
    let Feature { name, parent, .. } = &rig.features[first];
    let tag = name.strip_suffix("/0")?;
    let (_, number) = tag.rsplit_once(':')?;
    number.parse::<u64>().ok()?;
    let place = |corner: usize| {
        let name = format!("{tag}/{corner}");
        rig.features.iter().position(|feature| feature.name == name && feature.parent == *parent)
    };
    Some([first, place(1)?, place(2)?, place(3)?])
}

/// Each is known so well, for its length, that those of all `tags` together are known as the side is: one printer made them.
fn sides_and_diagonals(
    rig: &Rig,
    tag: [usize; 4],
    [side, sd]: [f64; 2],
    tags: usize,
) -> impl Iterator<Item = (Length, Found)> {
    let share = sd / side * (6.0 * tags as f64).sqrt();
    let pairs = (0..4).flat_map(move |one| (one + 1..4).map(move |other| [one, other]));
    pairs.map(move |[one, other]| {
        let ends = [tag[one], tag[other]];
        let between = Ends::Features(ends.map(|feature| rig.features[feature].name.clone()));
        let length = if other - one == 2 { SQRT_2 * side } else { side };
        (Length { between, length, sd: share * length }, Found::Features(ends))
    })
}

/// What all lengths of a state have to be multiplied by so that those that were measured come out best; `None` where none was.
pub(crate) fn scale(setup: &Setup, state: &State) -> Option<f64> {
    let (mut wanted, mut now) = (0.0, 0.0);
    for (length, found) in &setup.lengths {
        let weighted = found.now(&state.model) / length.sd;
        (wanted, now) = (wanted + weighted * length.length / length.sd, now + weighted * weighted);
    }
    let by = wanted / now;
    (by > 0.0 && by.is_finite()).then_some(by)
}

/// Adds a factor for each.
pub(crate) fn measure(setup: &Setup, loss: Loss, built: &mut Built) {
    for &(Length { length, sd, .. }, found) in &setup.lengths {
        let graph = &mut built.graph;
        let key = match found {
            Found::Features([one, other]) => {
                let on = (built.features[one], built.features[other]);
                graph.factor(PointDistance { length }, on).sigma(sd).loss(loss).key
            }
            Found::Cameras([one, other]) => {
                let on = (built.cameras[one].0, built.cameras[other].0);
                graph.factor(OriginDistance { length }, on).sigma(sd).loss(loss).key
            }
        };
        built.known[3].push(key);
    }
}

/// How long what was measured is in a rig [m], where the rig misses it.
fn missed_by((length, found): &(Length, Found), model: &Model) -> Option<f64> {
    let learned = found.now(model);
    ((learned - length.length).abs() > MISSED * length.sd).then_some(learned)
}

/// What is told of those that the learned rig misses.
pub(crate) fn missed(setup: &Setup, state: &State) -> impl Iterator<Item = Finding> {
    let told = |one: &(Length, Found)| {
        let learned = missed_by(one, &state.model)?;
        Some(Finding::MissedLength { length: one.0.clone(), learned })
    };
    setup.lengths.iter().filter_map(told)
}

/// Leaves out those that the learned rig misses: they tell nothing of it.
pub(crate) fn leave_out_missed(setup: &mut Setup, state: &State) {
    setup.lengths.retain(|one| missed_by(one, &state.model).is_none());
}
