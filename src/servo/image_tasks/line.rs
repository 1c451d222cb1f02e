//! Lines through two pixels.
use handeye_solvers::Scalar;
use nalgebra::Vector3;

/// Signed distance of a point from the line through `from` and `to` [px]: positive where the line's direction turns towards v from u.
///
///   ((b - a) × (p - a)) / |b - a|, which is l·p for the line l = a × b in homogeneous coordinates, scaled to a unit normal
pub(super) fn distance<T: Scalar>(point: &Vector3<T>, from: &Vector3<T>, to: &Vector3<T>) -> T {
    let along = unit(difference(from, to));
    cross(along, difference(from, point))
}

/// `to` - `from` in the image.
pub(super) fn difference<T: Scalar>(from: &Vector3<T>, to: &Vector3<T>) -> [T; 2] {
    [to.x - from.x, to.y - from.y]
}

/// Its direction; NaN where it has none.
pub(super) fn unit<T: Scalar>([x, y]: [T; 2]) -> [T; 2] {
    let length = (x * x + y * y).sqrt();
    [x / length, y / length]
}

pub(super) fn cross<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[1] - a[1] * b[0]
}

/// How far the end of `segment` is beside the unit direction `along`, with both begun in one point [px].
///
/// With δ the angle between them and L the segment's length: L sin δ, which is 0 where they point opposite ways too. `directed`:
/// 2 L sin (δ / 2) with δ in (-π, π], which is 0 only where they point the same way.
pub(super) fn turned<T: Scalar>(along: [T; 2], segment: [T; 2], directed: bool) -> T {
    let sine = cross(along, segment);
    let cosine = along[0] * segment[0] + along[1] * segment[1];
    let length = (segment[0] * segment[0] + segment[1] * segment[1]).sqrt();
    if !directed {
        return sine;
    }
    // 2 L sin (δ / 2) = L sin δ √(2 / (1 + cos δ))
    let both = (length + cosine) / length;
    if both.value() < OPPOSITE {
        let side = if sine.value() < 0.0 { -2.0 } else { 2.0 };
        return length * side;
    }
    sine * (T::from(2.0) / both).sqrt()
}

/// 1 + cos δ of segments that point opposite ways, where the half-angle has no derivative worth having.
const OPPOSITE: f64 = 1e-12;
