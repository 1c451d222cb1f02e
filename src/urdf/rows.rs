//! Rows of the modified convention from axes and links.
//!
//! Row i, Rx(alpha) Ry(beta) Tx(a) Rz(offset + q) Tz(d), leads from a frame on the axis before to one on its own. Where that
//! frame stands along its axis and how it is turned about it is open; it is put where the next row needs it, else as near to
//! the link's own frame as can be. What remains between the two is constant, and stands beside the row.
use super::arm::Moving;
use crate::chain::{Convention, JointKind, LINK_PARAMETERS, PARALLEL};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};

/// Distance between two lines below which they meet [m]: rounding of coordinates of a metre.
const MEETING: f64 = 1e-14;

/// A joint's row, and its link against it.
pub(super) struct Placed {
    pub(super) row: [f64; LINK_PARAMETERS],
    pub(super) has_beta: bool,
    /// `row_from_link`.
    pub(super) frame: Pose,
}

/// A directed line.
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
}

/// What leads from the frame of a row to the axis of the next.
struct Twist {
    /// Frame on the axis before, z along it, in the base.
    from: Pose,
    a: f64,
    alpha: f64,
    /// Where the axes are nearly parallel.
    beta: Option<f64>,
}

/// `base_from_start`, and the joints' rows. The chain with all readings at 0 is the URDF's.
pub(super) fn rows(moving: &[Moving], tool: &Pose) -> (Pose, Vec<Placed>) {
    let mut links: Vec<Pose> = Vec::with_capacity(moving.len());
    for joint in moving {
        let before = links.last().copied().unwrap_or_else(Pose::identity);
        links.push(before * joint.before * joint.origin);
    }
    // As rotations round, an axis is 1 long to a few digits only.
    let line =
        |i: usize| Line { point: links[i].translation, direction: (links[i].rotation * moving[i].axis).normalize() };
    let first = line(0);
    let start = Pose {
        rotation: axes(&reference(&Matrix3::identity(), &first.direction), &first.direction),
        translation: foot(&Vector3::zeros(), &first),
    };
    let mut placed = Vec::with_capacity(moving.len());
    // z of this frame is the row's axis already; its product is kept, so that rounding goes into the links' frames.
    let mut before_turn = start;
    let mut twist = [0.0; 3];
    let mut has_beta = false;
    for (i, link) in links.iter().enumerate() {
        let reference = reference(&link.rotation, &before_turn.rotation.column(2).into_owned());
        let next = (i + 1 < moving.len()).then(|| twist_to(&line(i), &reference, &line(i + 1)));
        let wanted = next
            .as_ref()
            .map_or(Pose { rotation: axes(&reference, &line(i).direction), translation: link.translation }, |next| {
                next.from
            });
        let local = before_turn.inverse() * wanted;
        let offset = local.rotation[(1, 0)].atan2(local.rotation[(0, 0)]);
        let [a, alpha, beta] = twist;
        let row = [offset, local.translation.z, a, alpha, beta];
        let turned =
            Convention::ModifiedDh.link(JointKind::Revolute, &[offset, local.translation.z, 0.0, 0.0, 0.0], 0.0);
        let row_frame = before_turn * turned;
        let link = if i + 1 == moving.len() { *link * *tool } else { *link };
        placed.push(Placed { row, has_beta, frame: row_frame.inverse() * link });
        if let Some(Twist { a, alpha, beta, .. }) = next {
            has_beta = beta.is_some();
            twist = [a, alpha, beta.unwrap_or(0.0)];
            let twisted = Convention::ModifiedDh.link(JointKind::Revolute, &[0.0, 0.0, a, alpha, twist[2]], 0.0);
            before_turn = row_frame * twisted;
        }
    }
    (start, placed)
}

/// From one axis to the next: along the common normal, or, where they are nearly parallel, from the origin of the link.
fn twist_to(line: &Line, reference: &Vector3<f64>, next: &Line) -> Twist {
    let (z, w) = (&line.direction, &next.direction);
    let across = z.cross(w);
    if across.norm() < PARALLEL {
        return parallel(line, reference, next);
    }
    let normal = across.normalize();
    let x = if normal.dot(reference) < -1e-9 { -normal } else { normal };
    let between = next.point - line.point;
    // Feet of the common normal: between + t w - s z has to be along x.
    let cosine = z.dot(w);
    let (along, back) = (between.dot(z), between.dot(w));
    let s = (along - cosine * back) / across.norm_squared();
    let t = (cosine * along - back) / across.norm_squared();
    let foot = line.point + z * s;
    let a = (next.point + w * t - foot).dot(&x);
    Twist {
        from: Pose { rotation: axes(&x, z), translation: foot },
        a,
        alpha: across.dot(&x).atan2(cosine),
        beta: None,
    }
}

/// Rz(turn) Rx(alpha) Ry(beta) takes the axes at the link's origin to those at the foot of its perpendicular on the next axis.
fn parallel(line: &Line, reference: &Vector3<f64>, next: &Line) -> Twist {
    let (z, w) = (&line.direction, &next.direction);
    let gap = foot(&line.point, next) - line.point;
    let x = if gap.norm() > MEETING { gap.normalize() } else { *reference };
    let x = (x - w * x.dot(w)).normalize();
    let x = if x.dot(reference) < -1e-9 { -x } else { x };
    let here = axes(reference, z);
    let r = here.tr_mul(&axes(&x, w));
    // Row 3 of the product is (-cos alpha sin beta, sin alpha, cos alpha cos beta), column 2 (-sin turn cos alpha, cos turn
    // cos alpha, sin alpha); of the two solutions, that with the smaller beta.
    let side = if r[(2, 2)] < 0.0 { -1.0 } else { 1.0 };
    let alpha = r[(2, 1)].atan2(side * r[(2, 0)].hypot(r[(2, 2)]));
    let beta = (-side * r[(2, 0)]).atan2(side * r[(2, 2)]);
    let turn = (-side * r[(0, 1)]).atan2(side * r[(1, 1)]);
    let turned = Convention::ModifiedDh.link(JointKind::Revolute, &[turn, 0.0, 0.0, 0.0, 0.0], 0.0).rotation;
    Twist { from: Pose { rotation: here * turned, translation: line.point }, a: gap.dot(&x), alpha, beta: Some(beta) }
}

/// The point of a line that is nearest to another.
fn foot(point: &Vector3<f64>, line: &Line) -> Vector3<f64> {
    line.point + line.direction * line.direction.dot(&(point - line.point))
}

/// The direction across an axis that is nearest to a frame's x, or to its y where x is the axis.
fn reference(frame: &Matrix3<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
    let across = |k: usize| {
        let side = frame.column(k);
        side - axis * axis.dot(&side)
    };
    let x = across(0);
    if x.norm() > PARALLEL { x.normalize() } else { across(1).normalize() }
}

/// A rotation of which these are the first and the last column.
fn axes(x: &Vector3<f64>, z: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[*x, z.cross(x), *z])
}
