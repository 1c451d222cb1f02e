//! What a task fixes before anything moves: degrees of freedom, free motions, and other placements where it ends too.
mod free;
mod motion;
mod names;
mod problem;
mod starts;
mod walk;

pub use free::FreeMotions;
pub use motion::{Displacement, Motion};

use super::{Geometry, ImageTask};
use crate::Error;
use free::free_motions;
use handeye_solvers::Pose;
use nalgebra::Vector3;
use names::Names;
use problem::{EXACT, Problem, Settled};
use rayon::prelude::*;
use walk::{are_connected, walk};

/// How a task is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckSettings {
    /// Placements from which solved ones are searched for. Default 80.
    pub starts: usize,
    /// Seed of these placements. Default 0.
    pub seed: u64,
    /// Standard deviations of a row that count as no error, where the geometry, which may have been measured, lets no placement solve the
    /// task exactly. Default 3.
    pub within: f64,
}

/// What a task fixes and leaves open.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskCheck {
    /// Rows of errors.
    pub rows: usize,
    /// Degrees of freedom of the hand that it fixes, of 6.
    pub fixed: usize,
    /// The others.
    pub free: FreeMotions,
    /// The fixed motion that shows least; `None` where nothing is fixed.
    pub weakest: Option<Weakest>,
    /// `world_from_hand` where the task is solved, of those at hand the one nearest to the identity.
    pub placement: Pose,
    /// Largest error that is left there [px].
    pub error_px: f64,
    /// Other placements that solve it, to which no free motion leads; nearest first.
    pub alternatives: Vec<Alternative>,
    /// Starts, half-turns of what was found first among them, and how many of them led to a solved placement.
    pub starts: [usize; 2],
    /// Degrees of freedom that are fixed at solved placements, and at how many of them; where there are several, some placements are
    /// singular.
    pub ranks: Vec<[usize; 2]>,
}

/// A motion that is fixed, though it shows little.
#[derive(Clone, Debug, PartialEq)]
pub struct Weakest {
    /// The motion.
    pub motion: Motion,
    /// Root of the sum of the squares by which it changes the rows [px/rad, or px/m of a translation].
    pub px: f64,
    /// In words.
    pub words: String,
}

/// Another placement that solves a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// `world_from_hand`, as near to the first placement as free motions lead.
    pub placement: Pose,
    /// From the first placement there.
    pub displacement: Displacement,
    /// Degrees of freedom that are fixed there.
    pub fixed: usize,
    /// Starts that led there.
    pub starts: usize,
    /// Largest error that is left there [px].
    pub error_px: f64,
    /// The displacement in words.
    pub words: String,
}

/// Solved placements that free motions connect.
struct Family {
    pose: Pose,
    rank: usize,
    starts: usize,
    error_px: f64,
}

/// Iterations from a start.
const ITERATIONS: usize = 150;

/// Solved placements whose half-turns are starts too.
const TURNED: usize = 3;

/// Families that are told apart at most.
const MOST: usize = 12;

impl Default for CheckSettings {
    fn default() -> Self {
        CheckSettings { starts: 80, seed: 0, within: 3.0 }
    }
}

/// Searches placements of the hand that solve a task, from starts anywhere around its target.
///
/// Degrees of freedom are the rank of the rows' slopes by a motion of the hand as a free body, whatever arm moves it. Placements belong
/// together where a walk along free motions, through solved placements in view, leads from one to the other.
///
/// Errors: [`Error::Unusable`] where the geometry is not the task's; [`Error::NotEnoughData`] where no start leads to a solved placement.
pub fn check(task: &ImageTask, geometry: &Geometry, settings: &CheckSettings) -> Result<TaskCheck, Error> {
    let [cameras, features] = [geometry.cameras.len(), geometry.points.len()];
    if [cameras, features] != [task.cameras().len(), task.features().len()] {
        return Err(Error::Unusable(format!(
            "a geometry of {cameras} cameras and {features} features is not this task's"
        )));
    }
    let mut problem = Problem::new(task, geometry);
    let mut starts = starts::starts(&problem, settings.starts.max(1), settings.seed);
    let settle = |start: &Pose| problem.settle(start, ITERATIONS);
    let mut settled: Vec<Settled> = starts.par_iter().filter_map(settle).collect();
    let is_solved = |settled: &&Settled| problem.is_solved(settled);
    let known: Vec<Pose> = settled.iter().filter(is_solved).take(TURNED).map(|settled| settled.pose).collect();
    let turned: Vec<Pose> = known.iter().flat_map(|pose| starts::half_turns(&problem, pose, settings.seed)).collect();
    settled.par_extend(turned.par_iter().filter_map(settle));
    starts.extend(turned);
    let mut solved: Vec<&Settled> = settled.iter().filter(|settled| problem.is_solved(settled)).collect();
    if solved.is_empty() {
        problem.allow_noise(geometry, &settled, settings.within);
        solved = settled.iter().filter(|settled| settled.is_still && problem.is_solved(settled)).collect();
    }
    if solved.is_empty() {
        return Err(unsolved(&problem, &settled));
    }
    let home = Pose { translation: problem.middle, ..Pose::identity() };
    let away = |settled: &Settled| problem.difference(&home, &settled.pose).norm();
    solved.sort_by(|a, b| away(a).total_cmp(&away(b)));
    let (families, ranks) = families(&problem, &solved);
    let first = &families[0];
    let null = problem.null(&first.pose);
    let names = Names::new(&problem, &first.pose);
    let weakest = null.weakest.map(|motion| {
        let turn: Vector3<f64> = motion.fixed_rows::<3>(0).into_owned();
        let velocity = problem.size * motion.fixed_rows::<3>(3);
        let (_, slopes) = problem.linearize(&first.pose);
        let motion_px = (slopes * motion).norm();
        let motion = Motion::of_twist(turn, velocity, first.pose.translation, problem.size);
        let rate = if motion.turn() == Vector3::zeros() { velocity.norm() } else { turn.norm() };
        Weakest { words: names.motion(&motion), motion, px: motion_px / rate }
    });
    let mut alternatives: Vec<Alternative> =
        families[1..].iter().map(|family| alternative(&problem, first, family, &names)).collect();
    let size = |by: &Displacement| by.angle.hypot(by.along / problem.size);
    alternatives.sort_by(|a, b| size(&a.displacement).total_cmp(&size(&b.displacement)));
    Ok(TaskCheck {
        rows: task.rows(),
        fixed: first.rank,
        free: free_motions(&problem, &first.pose, &null, &names),
        weakest,
        placement: problem.world_from_hand(&first.pose),
        error_px: first.error_px,
        alternatives,
        starts: [starts.len(), solved.len()],
        ranks,
    })
}

/// Families of solved placements, the first that of the first, and how many have which rank.
fn families(problem: &Problem, solved: &[&Settled]) -> (Vec<Family>, Vec<[usize; 2]>) {
    let mut families: Vec<Family> = Vec::new();
    let mut ranks: Vec<[usize; 2]> = Vec::new();
    for settled in solved {
        let pose = settled.pose;
        let rank = problem.null(&pose).rank;
        match ranks.iter_mut().find(|[known, _]| *known == rank) {
            Some([_, count]) => *count += 1,
            None => ranks.push([rank, 1]),
        }
        let is_near = |family: &Family| problem.difference(&pose, &family.pose).norm() < NEAR;
        let known = families
            .iter()
            .position(|family| is_near(family) || walk(problem, &pose, &family.pose).arrived)
            .or_else(|| families.iter().position(|family| are_connected(problem, &family.pose, &pose)));
        match known {
            Some(index) => {
                families[index].starts += 1;
                // A singular placement does not stand for its family.
                if rank > families[index].rank && index > 0 {
                    (families[index].rank, families[index].pose) = (rank, pose);
                }
            }
            None if families.len() < MOST => {
                families.push(Family { pose, rank, starts: 1, error_px: largest(&settled.errors) });
            }
            None => {}
        }
    }
    ranks.sort_by_key(|rank| std::cmp::Reverse(*rank));
    (families, ranks)
}

/// Placements nearer than this are one [rad, sizes of the hand].
const NEAR: f64 = 1e-3;

fn largest(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |most: f64, error| most.max(error.abs()))
}

fn alternative(problem: &Problem, first: &Family, family: &Family, names: &Names) -> Alternative {
    let nearest = walk(problem, &family.pose, &first.pose).pose;
    let displacement = Displacement::between(&first.pose, &nearest, problem.size);
    Alternative {
        placement: problem.world_from_hand(&nearest),
        words: names.displacement(&displacement),
        displacement,
        fixed: family.rank,
        starts: family.starts,
        error_px: family.error_px,
    }
}

fn unsolved(problem: &Problem, settled: &[Settled]) -> Error {
    let in_view = settled.iter().filter(|settled| problem.is_in_view(&settled.pose));
    match in_view.map(|settled| largest(&settled.errors)).min_by(f64::total_cmp) {
        Some(least) => Error::NotEnoughData(format!(
            "no placement of the hand solves the task: the nearest leaves {least:.2} px; distances between features of the hand and of the \
             target do not match"
        )),
        None => Error::NotEnoughData(
            "no placement of the hand has all that the task needs in view and defined: cameras have to see the target"
                .to_owned(),
        ),
    }
}

impl Problem<'_> {
    /// Where no placement is exact, what the trackers' noise hides counts as no error: by the rows' standard deviations where least is left.
    fn allow_noise(&mut self, geometry: &Geometry, settled: &[Settled], within: f64) {
        let in_view = settled.iter().filter(|settled| settled.is_still && self.is_in_view(&settled.pose));
        let Some(best) = in_view.min_by(|a, b| largest(&a.errors).total_cmp(&largest(&b.errors))) else { return };
        let rows = self.task.errors(&geometry.see(self.task, &self.world_from_hand(&best.pose)));
        let most = |row: &super::RowError| (within * row.sd).max(EXACT);
        self.tolerance = rows.iter().map(most).collect();
        self.least_slope = self.tolerance.iter().map(|most| most * most).sum::<f64>().sqrt();
    }
}
