//! The motions that a task leaves free, as few and as simple ones as span them.
use super::motion::Motion;
use super::names::Names;
use super::problem::{Null, Problem};
use handeye_solvers::Pose;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};

/// Motions that change no error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FreeMotions {
    /// As many as are free, independent: every free motion is a sum of these.
    pub motions: Vec<Motion>,
    /// The same in words, where "any rotation about a point" stands for three.
    pub words: Vec<String>,
}

/// Part of a unit motion that may show, as a length: what lies within is free.
const WITHIN: f64 = 1e-4;

/// What is left of a unit motion that is no sum of others.
const INDEPENDENT: f64 = 0.05;

/// Free motions at a placement, in coordinates about the hand's middle: rotation, and translation in sizes of the hand.
struct Space<'a> {
    basis: &'a DMatrix<f64>,
    found: Vec<Vector6<f64>>,
}

impl Space<'_> {
    /// Directions of a family of motions, the columns, that are free: orthonormal in the family's own coordinates.
    fn free_of(&self, family: &DMatrix<f64>) -> Vec<DVector<f64>> {
        let outside = family - self.basis * (self.basis.transpose() * family);
        let eigen = (outside.transpose() * &outside).symmetric_eigen();
        let is_free = |k: &usize| eigen.eigenvalues[*k].max(0.0).sqrt() < WITHIN;
        (0..family.ncols()).filter(is_free).map(|k| eigen.eigenvectors.column(k).into_owned()).collect()
    }

    fn is_new(&self, motion: &Vector6<f64>) -> bool {
        let unit = motion.normalize();
        let rest = self.found.iter().fold(unit, |rest, found| rest - found * found.dot(&rest));
        rest.norm() > INDEPENDENT
    }

    /// Takes a motion in, where it is no sum of those before.
    fn take(&mut self, motion: &Vector6<f64>) -> bool {
        let is_new = self.is_new(motion);
        if is_new {
            let unit = motion.normalize();
            let rest = self.found.iter().fold(unit, |rest, found| rest - found * found.dot(&rest));
            self.found.push(rest.normalize());
        }
        is_new
    }
}

/// In what order motions are looked for: translations, rotations about features, and whatever is left as screws.
pub(super) fn free_motions(problem: &Problem, pose: &Pose, null: &Null, names: &Names) -> FreeMotions {
    let mut space = Space { basis: &null.basis, found: Vec::new() };
    let mut free = FreeMotions::default();
    translations(&mut space, &mut free, names);
    while space.found.len() < null.basis.ncols() && rotations(problem, pose, &mut space, &mut free, names) {}
    let shifts: Vec<Vector3<f64>> =
        free.motions.iter().filter(|m| m.turn() == Vector3::zeros()).map(|m| m.velocity(&Vector3::zeros())).collect();
    for column in null.basis.column_iter() {
        let column: Vector6<f64> = column.fixed_rows::<6>(0).into_owned();
        let rest = space.found.iter().fold(column, |rest, found| rest - found * found.dot(&rest));
        if rest.norm() > INDEPENDENT && space.found.len() < null.basis.ncols() {
            space.take(&rest);
            let turn: Vector3<f64> = rest.fixed_rows::<3>(0).into_owned();
            let velocity = without_pitch(&turn, problem.size * rest.fixed_rows::<3>(3), &shifts);
            let motion = Motion::of_twist(turn, velocity, pose.translation, problem.size);
            free.words.push(names.motion(&motion));
            free.motions.push(motion);
        }
    }
    free
}

fn translations(space: &mut Space, free: &mut FreeMotions, names: &Names) {
    let family = DMatrix::from_fn(6, 3, |i, k| if i == 3 + k { 1.0 } else { 0.0 });
    let directions: Vec<Vector3<f64>> =
        space.free_of(&family).iter().map(|found| Vector3::new(found[0], found[1], found[2])).collect();
    for direction in &directions {
        space.take(&Vector6::new(0.0, 0.0, 0.0, direction.x, direction.y, direction.z));
        free.motions.push(Motion::Translation { direction: *direction });
    }
    match directions.as_slice() {
        [] => {}
        [one] => free.words.push(names.motion(&Motion::Translation { direction: *one })),
        [one, other] => free.words.push(format!("translations across {}", names.direction(&one.cross(other)))),
        _ => free.words.push("any translation".to_owned()),
    }
}

/// The axis of a rotation about a feature, and its motion.
type Turn = (Vector3<f64>, Vector6<f64>);

/// Rotations about the feature that most of those left go through; false where none does.
fn rotations(problem: &Problem, pose: &Pose, space: &mut Space, free: &mut FreeMotions, names: &Names) -> bool {
    let about = |point: &Vector3<f64>| -> Vec<Turn> {
        // A rotation about the point moves the hand's middle m by w × (m - point).
        let arm = (pose.translation - point) / problem.size;
        let by = Matrix3::new(0.0, arm.z, -arm.y, -arm.z, 0.0, arm.x, arm.y, -arm.x, 0.0);
        let family = DMatrix::from_fn(6, 3, |i, k| if i < 3 { f64::from(u8::from(i == k)) } else { by[(i - 3, k)] });
        let of = |found: &DVector<f64>| {
            let motion = &family * found;
            (Vector3::new(found[0], found[1], found[2]), motion.fixed_rows::<6>(0).into_owned())
        };
        space.free_of(&family).iter().map(of).filter(|(_, motion)| space.is_new(motion)).collect()
    };
    let mut best: Option<(Vector3<f64>, Vec<Turn>)> = None;
    for point in names.points() {
        let found = about(&point);
        if !found.is_empty() && best.as_ref().is_none_or(|(_, most)| found.len() > most.len()) {
            best = Some((point, found));
        }
    }
    let Some((point, found)) = best else { return false };
    let taken: Vec<Vector3<f64>> =
        found.iter().filter(|(_, motion)| space.take(motion)).map(|(axis, _)| axis.normalize()).collect();
    free.motions.extend(taken.iter().map(|&direction| Motion::Rotation { point, direction }));
    match taken.as_slice() {
        [direction] => free.words.push(names.motion(&Motion::Rotation { point, direction: *direction })),
        [one, other] => {
            let across = names.direction(&one.cross(other));
            free.words.push(format!("rotations about {} with axes across {across}", names.point(&point)));
        }
        _ => free.words.push(format!("any rotation about {}", names.point(&point))),
    }
    !taken.is_empty()
}

/// The velocity of a screw, less what free translations may take away of it.
fn without_pitch(turn: &Vector3<f64>, velocity: Vector3<f64>, shifts: &[Vector3<f64>]) -> Vector3<f64> {
    let rest = shifts.iter().fold(velocity, |rest, shift| rest - shift * shift.dot(&rest));
    let steepest = shifts.iter().max_by(|a, b| a.dot(turn).abs().total_cmp(&b.dot(turn).abs()));
    match steepest.filter(|shift| shift.dot(turn).abs() > 0.1 * turn.norm()) {
        Some(shift) => rest - shift * (turn.dot(&rest) / turn.dot(shift)),
        None => rest,
    }
}
