//! Cameras: a point in the camera frame [m] to a pixel [px] and back; one file per camera model.
//!
//! Every model is a lens followed by the same affine map: pixel = (fx x' + cx, fy y' + cy) with (x', y') = lens(point).
//! A model's file gives its name in files, the names of its coefficients, `lens`, and the chart `ray` with what it
//! sees, on which lenses are inverted. A new one needs its file and a line in the list below.
use handeye_solvers::Scalar;
use nalgebra::Vector3;

mod brown_conrady;
mod kannala_brandt;
mod linearize;
mod perspective;
mod pinhole;
mod rational;
mod unproject;

/// Numbers of a camera: fx, fy, cx, cy [px], then 8 distortion coefficients, 0 where the model has fewer.
pub const PARAMETERS: usize = 12;

macro_rules! camera_models {
    ($($(#[$attribute:meta])* $model:ident => $file:ident,)*) => {
        /// Which formula turns a direction into a pixel.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub enum CameraModel {
            $($(#[$attribute])* $model,)*
        }

        impl CameraModel {
            /// Every camera model.
            pub const ALL: &'static [CameraModel] = &[$(CameraModel::$model),*];

            /// Its name in files.
            pub fn name(self) -> &'static str {
                match self { $(CameraModel::$model => $file::NAME,)* }
            }

            /// Names of its distortion coefficients, in order.
            pub fn distortion(self) -> &'static [&'static str] {
                match self { $(CameraModel::$model => $file::DISTORTION,)* }
            }

            /// Distorted normalised image coordinates (x', y') of a point in the camera frame, in any unit of length.
            ///
            /// `distortion`: the coefficients named by [`CameraModel::distortion`]; any that follow are ignored.
            /// Finite, with finite derivatives, for every finite point, in front or behind (see `perspective.rs`).
            #[inline]
            pub fn lens<T: Scalar>(self, distortion: &[T], point_in_camera: &Vector3<T>) -> [T; 2] {
                match self { $(CameraModel::$model => $file::lens(distortion, point_in_camera),)* }
            }

            /// True where the lens can see a point in the camera frame: in front of the image plane, or, through a
            /// fisheye, anywhere but at the centre.
            pub fn is_in_front(self, point_in_camera: &Vector3<f64>) -> bool {
                match self { $(CameraModel::$model => $file::sees(point_in_camera),)* }
            }

            /// The direction, of any length, that two numbers stand for where the lens is inverted.
            fn ray<T: Scalar>(self, chart: [T; 2]) -> Vector3<T> {
                match self { $(CameraModel::$model => $file::ray(chart),)* }
            }
        }
    };
}

camera_models! {
    /// No distortion.
    #[default]
    Pinhole => pinhole,
    /// Radial and tangential distortion, k1 k2 p1 p2 k3.
    BrownConrady => brown_conrady,
    /// Rational radial and tangential distortion, k1 k2 p1 p2 k3 k4 k5 k6.
    Rational => rational,
    /// Fisheye, k1 k2 k3 k4.
    KannalaBrandt => kannala_brandt,
}

impl CameraModel {
    /// The model of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|model| model.name() == name)
    }

    /// Pixel [px] of a point in the camera frame [m], with the 12 numbers of [`PARAMETERS`].
    #[inline]
    pub fn project<T: Scalar>(self, parameters: &[T; PARAMETERS], point_in_camera: &Vector3<T>) -> [T; 2] {
        let [fx, fy, cx, cy, distortion @ ..] = parameters;
        let [x, y] = self.lens(distortion, point_in_camera);
        [*fx * x + *cx, *fy * y + *cy]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use handeye_solvers::scalar::{derivatives, seed};

    pub(super) fn parameters(model: CameraModel) -> [f64; PARAMETERS] {
        let mut all = [600.0, 590.0, 320.0, 240.0, -0.05, 0.01, 1e-3, -5e-4, 2e-3, 0.03, -2e-3, 1e-3];
        all[4 + model.distortion().len()..].fill(0.0);
        all
    }

    /// Checks pixels of a camera with fx 600, fy 590, cx 320, cy 240.
    pub(super) fn agrees(model: CameraModel, distortion: [f64; 8], expected: &[([f64; 3], [f64; 2])]) {
        let mut all = parameters(CameraModel::Pinhole);
        all[4..].copy_from_slice(&distortion);
        for &(point, pixel) in expected {
            let [u, v] = model.project(&all, &Vector3::from(point));
            assert!((u - pixel[0]).hypot(v - pixel[1]) < 1e-9, "{point:?}: {u} {v}");
        }
    }

    fn points() -> Vec<Vector3<f64>> {
        [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1e-9, -2e-9, 0.7],
            [1e-4, 2e-4, 1.0],
            [0.01, -0.02, 1.0],
            [0.3, -0.2, 1.1],
            [-0.9, 0.5, 0.8],
            [0.4, 0.1, 0.009],
            [0.4, 0.1, 0.0],
            [0.4, 0.1, -0.3],
            [-0.01, 0.03, -2.0],
        ]
        .map(Vector3::from)
        .to_vec()
    }

    #[test]
    fn names_are_found_again() {
        for &model in CameraModel::ALL {
            assert_eq!(CameraModel::from_name(model.name()), Some(model));
            assert!(model.distortion().len() <= PARAMETERS - 4);
        }
        assert_eq!(CameraModel::from_name("fisheye"), None);
    }

    #[test]
    fn derivatives_agree_with_differences_near_the_axis_and_behind() {
        for &model in CameraModel::ALL {
            let all = parameters(model);
            let at = |p: &Vector3<f64>, c: &[f64; PARAMETERS]| model.project(c, p);
            // Straight behind a fisheye is where one point has a whole circle for its image.
            let smooth = |p: &&Vector3<f64>| model != CameraModel::KannalaBrandt || p.x != 0.0 || p.z > 0.0;
            for p in points().iter().filter(smooth) {
                let lifted = Vector3::from_fn(|i, _| seed::<15>(p[i], i));
                let pixel = model.project(&std::array::from_fn(|i| seed::<15>(all[i], 3 + i)), &lifted);
                for i in 0..15 {
                    let h = if i < 3 { 1e-7 } else { 1e-6 };
                    let moved = |s: f64| {
                        let (mut p, mut c) = (*p, all);
                        if i < 3 {
                            p[i] += s
                        } else {
                            c[i - 3] += s
                        }
                        at(&p, &c)
                    };
                    let (high, low) = (moved(h), moved(-h));
                    for k in 0..2 {
                        let difference = (high[k] - low[k]) / (2.0 * h);
                        let d = derivatives(&pixel[k])[i];
                        let bound = 1e-5 * (1.0 + d.abs()) + 1e-14 * high[k].abs() / h;
                        assert!((d - difference).abs() < bound, "{} at {p}, {i}: {d} {difference}", model.name());
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_is_infinite_anywhere() {
        for &model in CameraModel::ALL {
            let all = parameters(model).map(|v| seed::<3>(v, 0));
            for p in points().iter().chain([Vector3::zeros(), Vector3::new(1e-170, 0.0, -1e-170)].iter()) {
                let pixel = model.project(&all, &Vector3::from_fn(|i, _| seed::<3>(p[i], i)));
                for value in pixel {
                    assert!(value.value().is_finite() && derivatives(&value).iter().all(|d| d.is_finite()), "{p}");
                }
            }
        }
    }
}
