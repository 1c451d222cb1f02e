//! Rows of a chain's convention from the lines of its axes.
use super::Lines;
use crate::chain::{Convention, JointKind, LINK_PARAMETERS, PARALLEL};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};

/// `world_from_base`, and offset, d, a, alpha, beta of every joint, whose chain moves as the lines do.
///
/// The base has its z on the first axis and its x along the common normal to the second, so that the first row has offset
/// and d of 0; so has the last row all of its numbers (standard convention) or its offset and d (modified): the tip is
/// not where the poses' tip was, but fixed to it.
pub(crate) fn rows(convention: Convention, kinds: &[JointKind], lines: &Lines) -> (Pose, Vec<f64>) {
    let n = kinds.len();
    let mut parameters = vec![0.0; LINK_PARAMETERS * n];
    let first = lines.directions[0];
    let start = any_normal(&first);
    // The frame of the row: z on its axis, x for now anywhere.
    let mut frame = Pose { rotation: axes_of(&start, &first), translation: lines.points[0] };
    let mut base = frame;
    for i in 0..n.saturating_sub(1) {
        let z = frame.rotation.column(2).into_owned();
        let next = lines.directions[i + 1];
        let anchor = if kinds[i + 1] == JointKind::Prismatic { frame.translation } else { lines.points[i + 1] };
        let across = z.cross(&next);
        let parallel = across.norm() < PARALLEL;
        // d along z to the foot of the common normal, then a along x to the next axis.
        let (d, foot_on_next) = if parallel {
            let t = (frame.translation - anchor).dot(&z) / next.dot(&z);
            (0.0, anchor + next * t)
        } else {
            feet(&frame.translation, &z, &anchor, &next)
        };
        let foot = frame.translation + z * d;
        let gap = foot_on_next - foot;
        let gap = gap - z * gap.dot(&z);
        let x = if gap.norm() > 1e-9 && (parallel || gap.norm() > 1e-3 * d.abs().max(1e-3)) {
            let x = gap.normalize();
            if parallel { x } else { across.normalize() * across.dot(&x).signum() }
        } else if parallel {
            frame.rotation.column(0).into_owned()
        } else {
            across.normalize()
        };
        let old_x = frame.rotation.column(0).into_owned();
        let offset = z.dot(&old_x.cross(&x)).atan2(old_x.dot(&x));
        let y = z.cross(&x);
        let local = Vector3::new(next.dot(&x), next.dot(&y), next.dot(&z));
        // Rx(alpha) Ry(beta) z = (sin beta, -sin alpha cos beta, cos alpha cos beta).
        let beta = if parallel { local.x.asin() } else { 0.0 };
        let alpha = (-local.y).atan2(local.z);
        let a = gap.dot(&x);
        if i == 0 {
            // The first row's offset and d belong to the base.
            base = Pose { rotation: axes_of(&x, &z), translation: foot };
        }
        let (offset, d) = if i == 0 { (0.0, 0.0) } else { (offset, d) };
        let row = LINK_PARAMETERS * i;
        match convention {
            Convention::Dh => parameters[row..row + 5].copy_from_slice(&[offset, d, a, alpha, beta]),
            Convention::ModifiedDh => {
                parameters[row..row + 2].copy_from_slice(&[offset, d]);
                parameters[row + 5 + 2..row + 10].copy_from_slice(&[a, alpha, beta]);
            }
        }
        let after = convention_free_link(&Pose { rotation: axes_of(&x, &z), translation: foot }, a, alpha, beta);
        frame = after;
    }
    (base, parameters)
}

/// The frame after Tx(a) Rx(alpha) Ry(beta).
fn convention_free_link(frame: &Pose, a: f64, alpha: f64, beta: f64) -> Pose {
    *frame * Convention::Dh.link(JointKind::Revolute, &[0.0, 0.0, a, alpha, beta], 0.0)
}

/// Along z from p, how far the foot of the common normal with the line (q, w) is, and the foot on that line.
fn feet(p: &Vector3<f64>, z: &Vector3<f64>, q: &Vector3<f64>, w: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let between = q - p;
    let c = z.dot(w);
    let determinant = 1.0 - c * c;
    let d = (between.dot(z) - c * between.dot(w)) / determinant;
    let e = (c * between.dot(z) - between.dot(w)) / determinant;
    (d, q + w * e)
}

fn any_normal(z: &Vector3<f64>) -> Vector3<f64> {
    z.cross(&Vector3::ith(z.iamin(), 1.0)).normalize()
}

fn axes_of(x: &Vector3<f64>, z: &Vector3<f64>) -> Matrix3<f64> {
    let x = (x - z * x.dot(z)).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), *z])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::Chain;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_chain_of_the_rows_moves_as_its_lines_do() {
        for seed in 0..100 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let n = 6;
            // Random arms with right angles and parallel axes among others, as real arms have them.
            let mut parameters = Vec::new();
            for _ in 0..n {
                let alpha = [0.0, 0.05, 1.57, -1.57, 0.7][rng.random_range(0..5)];
                let beta = if alpha == 0.05 { 0.03 } else { 0.0 };
                let a = [0.0, 0.3, -0.2][rng.random_range(0..3)];
                parameters.extend([rng.random_range(-3.0..3.0), rng.random_range(-0.4..0.4), a, alpha, beta]);
            }
            let kinds = vec![JointKind::Revolute; n];
            let chain = |convention| Chain { convention, kinds: kinds.clone(), reversed: vec![false; n], frames: None };
            let truth = chain(Convention::Dh);
            let base = Pose::new(Vector3::new(0.3, -0.4, 0.9), Vector3::new(1.0, 0.2, -0.5));
            let links: Vec<Pose> =
                std::iter::once(base).chain(truth.links(&base, &parameters, &vec![0.0; n])).collect();
            let lines = Lines {
                points: links[..n].iter().map(|link| link.translation).collect(),
                directions: links[..n].iter().map(|link| link.rotation.column(2).into_owned()).collect(),
                at_zero: links[n],
                unit: None,
            };
            let (found_base, found) = rows(Convention::Dh, &kinds, &lines);
            let tip_from_found = truth.tip(&found_base, &found, &vec![0.0; n]).inverse() * links[n];
            for _ in 0..20 {
                let joints: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
                let expected = truth.tip(&base, &parameters, &joints);
                let moved = truth.tip(&found_base, &found, &joints) * tip_from_found;
                assert!((moved.translation - expected.translation).norm() < 1e-9, "seed {seed}");
                assert!(moved.angle_to(&expected) < 1e-9, "seed {seed}");
            }
        }
    }
}
