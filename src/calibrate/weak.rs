//! Combinations of numbers that the data leave open: in words and numbers, what they cost at the tip, and what would help.
use super::cures::cure;
use super::deviations::{Honest, name};
use super::direction::Direction;
use super::graph::{Built, State};
use super::moves;
use handeye_solvers::{Component, WeakDirection, Weakness};

/// Numbers of a rig that can move together without the data objecting much.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Parameter paths and how far each moves, in its own unit; the largest first and 1.
    pub numbers: Vec<(String, f64)>,
    /// What moves together, in words: the largest parts, and how many smaller ones there are.
    pub moves: String,
    /// What determines it.
    pub determined_by: DeterminedBy,
    /// Standard deviation of the tip's position that comes of it, root mean square over the recorded samples [m, or the
    /// model's unit]; `None` where nothing bounds it.
    pub tip: Option<f64>,
    /// What would determine it at the least expense, in words; empty where nothing that can be seen would.
    pub cure: String,
}

/// What determines a combination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeterminedBy {
    /// Nothing.
    Nothing,
    /// A prior more than the data: the standard deviation from the data over that from the priors, infinite where the data
    /// say nothing.
    Prior(f64),
    /// The data, and poorly: the case is ill-posed.
    Poorly {
        /// Standard deviation of the positions and lengths that take part, together [m, or the model's unit].
        sd: f64,
        /// The same as a share of the distance between cameras and features.
        share: f64,
        /// True where it is in metres.
        metric: bool,
    },
}

/// Combinations that are put in words.
const DIRECTIONS: usize = 6;

/// Combinations of which a cure is looked for.
const CURED: usize = 24;

impl Combination {
    /// Of what nothing, or a prior more than the data, determines.
    pub(crate) fn all(honest: &Honest<'_>, state: &State, built: &Built, found: &[WeakDirection]) -> Vec<Self> {
        let one = |(rank, weak): (usize, &WeakDirection)| {
            let determined_by = match weak.kind {
                Weakness::Open => DeterminedBy::Nothing,
                Weakness::Prior => DeterminedBy::Prior(weak.sd_ratio),
            };
            let direction = Direction::of_weak(honest, built, weak);
            Combination::new(honest, state, built, &direction, determined_by, rank < CURED)
        };
        found.iter().enumerate().map(one).collect()
    }

    pub(crate) fn new(
        honest: &Honest<'_>,
        state: &State,
        built: &Built,
        direction: &Direction,
        determined_by: DeterminedBy,
        is_cured: bool,
    ) -> Self {
        let setup = &honest.setup;
        let samples: Vec<usize> = (0..setup.len()).collect();
        let rms = |all: Vec<f64>| (all.iter().map(|x| x * x).sum::<f64>() / all.len().max(1) as f64).sqrt();
        let of_part = |part: &Component| (name(setup, built, part.node, part.coordinate), part.weight);
        let numbers: Vec<(String, f64)> = direction.parts.iter().map(of_part).collect();
        Combination {
            moves: moves::in_words(&setup.rig, &numbers),
            numbers,
            determined_by,
            tip: direction.tip_motion(honest, state, built, &samples).map(rms),
            cure: if is_cured { cure(honest, state, built, direction) } else { String::new() },
        }
    }
}

impl std::fmt::Display for Combination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.determined_by {
            DeterminedBy::Nothing => write!(f, "nothing determines ")?,
            DeterminedBy::Prior(ratio) if ratio > 1e3 => write!(f, "only a prior determines ")?,
            DeterminedBy::Poorly { sd, share, metric } => {
                let length = if metric { format!("{:.1} mm, ", 1e3 * sd) } else { String::new() };
                write!(f, "ill-posed: the data determine only to {length}{:.1} % of the distance ", 1e2 * share)?;
                write!(f, "between cameras and features (one standard deviation) ")?;
            }
            DeterminedBy::Prior(ratio) => write!(f, "a prior more than the data ({ratio:.1} to 1) determines ")?,
        }
        f.write_str(&self.moves)?;
        if !self.cure.is_empty() {
            write!(f, "; {}", self.cure)?;
        }
        Ok(())
    }
}

/// The weakest, and how many there are besides; those that can be cured come first.
pub(crate) fn in_words(all: &[Combination]) -> Vec<String> {
    let mut order: Vec<&Combination> = all.iter().collect();
    order.sort_by_key(|one| one.cure.is_empty());
    let mut words: Vec<String> = order.into_iter().take(DIRECTIONS).map(Combination::to_string).collect();
    if all.len() > DIRECTIONS {
        words.push(format!("and {} combinations more like these", all.len() - DIRECTIONS));
    }
    words
}
