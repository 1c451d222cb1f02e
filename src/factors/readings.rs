//! What a robot read around a moment, as a polynomial of time: readings that carry a clock's offset.
use handeye_solvers::manifold::so3;
use handeye_solvers::{DynamicVector, Factor, Function, Pose, Scalar, Vector};
use nalgebra::Vector3;

/// x(τ) = Σ cₖ τᵏ with τ = `delay` - offset: the image was stamped `delay` after the moment that the polynomial is around, and
/// was taken `offset` before its stamp [s].
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    /// Time from the polynomial's origin to the image's stamp [s].
    pub delay: f64,
    /// c₀, c₁, ...: one row per power of time.
    pub coefficients: Vec<Vec<f64>>,
}

impl Polynomial {
    fn at<T: Scalar>(&self, offset: T, component: usize) -> T {
        let tau = -offset + self.delay;
        self.coefficients.iter().rev().fold(T::from(0.0), |sum, row| sum * tau + row[component])
    }
}

/// `world_from_tip` as the robot reported it: R exp(w(τ)) and t + v(τ), with (w, v) a polynomial around a reported pose.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseReadings {
    /// The pose that the polynomial is around.
    pub centre: Pose,
    /// w [rad] in the tip's frame and v [m] in the world.
    pub motion: Polynomial,
}

impl PoseReadings {
    /// `world_from_tip` where the clock of the images is `offset` ahead [s].
    pub fn at<T: Scalar>(&self, offset: T) -> Pose<T> {
        let [w, v] = [0, 3].map(|k| Vector3::from_fn(|i, _| self.motion.at(offset, k + i)));
        Pose {
            rotation: so3::times(&self.centre.rotation.map(T::from), &so3::exp(&w)),
            translation: v + self.centre.translation.map(T::from),
        }
    }
}

impl Function for PoseReadings {
    type On = (Vector<1>,);
    type Output = Pose;

    fn compute<T: Scalar>(&self, (offset,): (Vector<1, T>,)) -> Pose<T> {
        self.at(offset[0])
    }
}

/// A tip's pose against its noisy reading, on `world_from_tip` and the offset: (log(R_readᵀ R), R_readᵀ (t - t_read)), both in the
/// tip's frame [rad, m] (eq. 8 of the paper).
impl Factor<6> for PoseReadings {
    type On = (Pose, Vector<1>);

    fn residual<T: Scalar>(&self, (tip, offset): (Pose<T>, Vector<1, T>)) -> [T; 6] {
        let error = self.at(offset[0]).inverse() * tip;
        let w = so3::log(&error.rotation);
        let v = error.translation;
        [w.x, w.y, w.z, v.x, v.y, v.z]
    }
}

/// Joint readings as a polynomial of time.
#[derive(Clone, Debug, PartialEq)]
pub struct JointReadings {
    /// One component per joint [rad or m].
    pub joints: Polynomial,
}

impl Function for JointReadings {
    type On = (Vector<1>,);
    type Output = DynamicVector;

    fn compute<T: Scalar>(&self, (offset,): (Vector<1, T>,)) -> DynamicVector<T> {
        let n = self.joints.coefficients.first().map_or(0, Vec::len);
        DynamicVector::<T>::from_fn(n, |i, _| self.joints.at(offset[0], i))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use handeye_solvers::check;

    fn readings() -> PoseReadings {
        let row = |k: f64| (0..6).map(|i| 0.3 * (k + f64::from(i)).sin()).collect();
        let centre = Pose::new(Vector3::new(0.3, -0.7, 1.1), Vector3::new(0.5, 0.1, -0.4));
        PoseReadings { centre, motion: Polynomial { delay: 0.4, coefficients: vec![row(0.0), row(1.0), row(2.0)] } }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let offset = Vector::<1>::new(0.05);
        let near = readings().at(0.02) * Pose::new(Vector3::repeat(0.03), Vector3::repeat(-0.1));
        check::factor::<_, 6>(&readings(), &(near, offset)).unwrap();
        check::function(&readings(), &(offset,)).unwrap();
        check::function(&JointReadings { joints: readings().motion }, &(offset,)).unwrap();
    }

    #[test]
    fn an_image_stamped_late_shows_an_earlier_pose() {
        let motion = Polynomial { delay: 0.0, coefficients: vec![vec![0.0; 6], vec![0.0, 0.0, 0.0, 2.0, 0.0, 0.0]] };
        let readings = PoseReadings { centre: Pose::identity(), motion };
        assert!((readings.at(0.1_f64).translation.x + 0.2).abs() < 1e-12);
    }
}
