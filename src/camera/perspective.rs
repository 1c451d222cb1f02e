//! Division by the depth, and what stands in for it behind the camera: shared by all models that have an image plane.
use handeye_solvers::Scalar;
use nalgebra::Vector3;

/// Cosine of the angle to the optical axis (88.9°) below which the depth is replaced: no such lens sees as far.
const EDGE: f64 = 0.02;

/// Below this squared distance to the centre [m²] a point is the centre itself.
const CENTRE: f64 = 1e-200;

/// Normalised image coordinates (x / z, y / z), for every point in space.
///
/// With s = z / |p| and S₀ = 0.02, the depth z is kept for s >= S₀ and is |p| S₀² / (2 S₀ - s) below, so that
///
///   * both pieces and their first derivatives meet at s = S₀, and the result does not depend on the unit of length;
///   * the depth stays positive: a point behind the camera keeps its side of the image, and lies the further out the
///     further behind it is (as far as 134° from the axis; the axis behind has to come back to the centre). A point
///     that a minimiser has carried behind is thereby pushed out in front again, where a bare division would change
///     sign and hold it there.
#[inline]
pub(super) fn divide<T: Scalar>(p: &Vector3<T>) -> [T; 2] {
    if keeps_depth(&Vector3::new(p.x.value(), p.y.value(), p.z.value())) {
        let inverse = T::one() / p.z;
        [p.x * inverse, p.y * inverse]
    } else {
        divide_behind(p)
    }
}

/// True where the depth is not replaced.
#[inline]
pub(super) fn keeps_depth(p: &Vector3<f64>) -> bool {
    p.z > 0.0 && p.z * p.z >= EDGE * EDGE * p.norm_squared()
}

#[cold]
fn divide_behind<T: Scalar>(p: &Vector3<T>) -> [T; 2] {
    let squared = p.x * p.x + p.y * p.y + p.z * p.z;
    if squared.value() < CENTRE {
        return [T::zero(); 2];
    }
    let inverse = (squared.sqrt() * (2.0 * EDGE) - p.z) / (squared * (EDGE * EDGE));
    [p.x * inverse, p.y * inverse]
}

/// In front of the image plane.
pub(super) fn sees(p: &Vector3<f64>) -> bool {
    p.z > 0.0
}

/// The direction whose undistorted normalised coordinates these are.
pub(super) fn ray<T: Scalar>([x, y]: [T; 2]) -> Vector3<T> {
    Vector3::new(x, y, T::one())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64) -> f64 {
        divide(&Vector3::new(angle.sin(), 0.0, angle.cos()))[0]
    }

    #[test]
    fn the_rule_does_not_depend_on_the_unit_of_length() {
        for p in [Vector3::new(0.2, 0.1, 0.5), Vector3::new(0.2, 0.1, -0.5), Vector3::new(0.2, 0.1, 0.001)] {
            let (here, scaled): ([f64; 2], [f64; 2]) = (divide(&p), divide(&(p * 1000.0)));
            assert!((here[0] / scaled[0] - 1.0).abs() < 1e-14 && (here[1] / scaled[1] - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn both_pieces_and_their_slopes_meet_at_the_edge() {
        let (edge, h) = (EDGE.acos(), 1e-9);
        assert!((at(edge + h) - at(edge - h)).abs() < 1e-5);
        let (before, after) = ((at(edge) - at(edge - h)) / h, (at(edge + h) - at(edge)) / h);
        assert!((before / after - 1.0).abs() < 1e-4);
    }

    #[test]
    fn the_distance_to_the_centre_grows_far_past_the_image_plane() {
        let degrees: Vec<f64> = (0..=134).map(|d| at(f64::from(d).to_radians())).collect();
        assert!(degrees.windows(2).all(|pair| pair[1] > pair[0]));
    }
}
