//! Rotations as files write them: quaternions and roll, pitch, yaw.
use handeye_solvers::manifold::so3;
use nalgebra::Matrix3;

/// Quaternions shorter than this are taken for a mistake: rounded ones are 1 up to a few digits.
const SHORTEST_QUATERNION: f64 = 1e-6;

/// The rotation of a quaternion `[x, y, z, w]` of any length but (nearly) zero.
pub(crate) fn from_quaternion(q: [f64; 4]) -> Option<Matrix3<f64>> {
    let largest = q.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    // Long ones would overflow when squared, and dividing a unit quaternion would cost it its last digit.
    let q = if largest > 1e100 { q.map(|v| v / largest) } else { q };
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    (norm > SHORTEST_QUATERNION).then(|| so3::from_quaternion(q))
}

/// Rz(yaw) Ry(pitch) Rx(roll): URDF's order, turns about the axes of the parent.
pub(crate) fn from_rpy([roll, pitch, yaw]: [f64; 3]) -> Matrix3<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
    Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    )
}

/// Roll, pitch and yaw of a rotation, pitch within a quarter turn.
pub(crate) fn to_rpy(r: &Matrix3<f64>) -> [f64; 3] {
    let pitch = (-r[(2, 0)]).atan2(r[(0, 0)].hypot(r[(1, 0)]));
    // With the pitch at a quarter turn, any yaw goes with a roll, which is what turns the other two axes as they are.
    let yaw = r[(1, 0)].atan2(r[(0, 0)]);
    let (s, c) = yaw.sin_cos();
    let roll = (s * r[(0, 2)] - c * r[(1, 2)]).atan2(c * r[(1, 1)] - s * r[(0, 1)]);
    [roll, pitch, yaw]
}

/// The unit quaternion that is written for a rotation, w >= 0.
///
/// Reading it back and writing it again gives the same digits. Conversion alone does not, since matrix and quaternion
/// wander from one another by last digits. So the quaternion is looked for of which reading makes this very matrix; it
/// depends on the matrix alone, and exists wherever the matrix was read from such a quaternion.
pub(crate) fn to_quaternion(rotation: &Matrix3<f64>) -> [f64; 4] {
    let rounded = on_grid(so3::quaternion(rotation));
    original(rotation, rounded).unwrap_or_else(|| {
        let read_back = so3::from_quaternion(rounded);
        original(&read_back, on_grid(so3::quaternion(&read_back))).unwrap_or(rounded)
    })
}

/// What components are multiples of: the spacing of floats just below 1, so that a step of any of them is as large.
const GRID: f64 = f64::EPSILON / 2.0;

fn on_grid(q: [f64; 4]) -> [f64; 4] {
    // Adding 0 makes -0, which reads like a slip, 0.
    q.map(|v| (v / GRID).round() * GRID + 0.0)
}

/// The quaternion nearest to `near` that reads as exactly this matrix.
fn original(rotation: &Matrix3<f64>, near: [f64; 4]) -> Option<[f64; 4]> {
    /// Steps by which the conversion from a matrix errs at most.
    const REACH: i32 = 4;
    (0..=REACH).find_map(|reach| {
        let side = 2 * reach + 1;
        (0..side.pow(4)).find_map(|index| {
            let steps = [index, index / side, index / side.pow(2), index / side.pow(3)].map(|i| i % side - reach);
            // Shells only: what is nearer was tried before.
            if steps.iter().all(|step| step.abs() < reach) && reach > 0 {
                return None;
            }
            let q = std::array::from_fn(|i| near[i] + f64::from(steps[i]) * GRID);
            (so3::from_quaternion(q) == *rotation).then_some(q)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_written_rotation_reads_back_and_writes_the_same_digits() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let fixed =
            [[0.0; 3], [0.0, 0.0, std::f64::consts::PI], [std::f64::consts::FRAC_PI_2, 0.0, 0.0], [1e-9, 0.0, 0.0]];
        let drawn = (0..3_000).map(|_| std::array::from_fn(|_| random.random_range(-3.0..3.0)));
        for w in fixed.into_iter().chain(drawn) {
            let rotation = so3::exp(&Vector3::from(w));
            let q = to_quaternion(&rotation);
            let back = so3::from_quaternion(q);
            assert!((back - rotation).amax() < 2e-15, "{w:?}: {:e}", (back - rotation).amax());
            let again = to_quaternion(&back);
            assert_eq!(again, q, "{w:?}");
            assert_eq!(so3::from_quaternion(again), back, "{w:?}: nothing is lost any more");
        }
    }

    #[test]
    fn roll_pitch_yaw_turn_about_the_axes_of_the_parent_as_in_urdf() {
        let theirs = Rotation3::from_axis_angle(&Vector3::z_axis(), 1.3)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), -0.4)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), 2.5);
        assert!((from_rpy([2.5, -0.4, 1.3]) - theirs.matrix()).amax() < 1e-15);
    }

    #[test]
    fn roll_pitch_yaw_that_are_written_read_back_as_the_rotation_with_the_pitch_at_a_quarter_turn_too() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let quarter = std::f64::consts::FRAC_PI_2;
        for pitch in [0.3, -1.2, quarter, -quarter, quarter - 1e-9, 1e-9 - quarter, quarter - 1e-4] {
            for _ in 0..200 {
                let [roll, yaw] = std::array::from_fn(|_| random.random_range(-3.2..3.2));
                let rotation = from_rpy([roll, pitch, yaw]);
                let back = from_rpy(to_rpy(&rotation));
                assert!((back - rotation).amax() < 1e-15, "{roll} {pitch} {yaw}: {:e}", (back - rotation).amax());
            }
        }
    }

    #[test]
    fn quaternions_need_no_unit_length_but_some() {
        let unit = from_quaternion([0.5, -0.5, 0.5, 0.5]).unwrap();
        for scale in [1e-5, 0.999, 7.0, 1e200] {
            let scaled = from_quaternion([0.5, -0.5, 0.5, 0.5].map(|v: f64| v * scale)).unwrap();
            assert!((scaled - unit).amax() < 1e-15, "{scale}");
        }
        assert_eq!(from_quaternion([0.0; 4]), None);
        assert_eq!(from_quaternion([0.0, 1e-300, 0.0, 0.0]), None);
    }
}
