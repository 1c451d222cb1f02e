//! Cameras: a point in the camera frame [m] to a pixel [px] and back; one file per camera model.

/// Which formula turns a direction into a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraModel {
    /// No distortion.
    #[default]
    Pinhole,
    /// Radial and tangential distortion, k1 k2 p1 p2 k3.
    BrownConrady,
    /// Rational radial and tangential distortion, k1 k2 p1 p2 k3 k4 k5 k6.
    Rational,
    /// Fisheye, k1 k2 k3 k4.
    KannalaBrandt,
}

impl CameraModel {
    /// Every camera model.
    pub const ALL: &'static [CameraModel] =
        &[CameraModel::Pinhole, CameraModel::BrownConrady, CameraModel::Rational, CameraModel::KannalaBrandt];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            CameraModel::Pinhole => "pinhole",
            CameraModel::BrownConrady => "brown-conrady",
            CameraModel::Rational => "rational",
            CameraModel::KannalaBrandt => "kannala-brandt",
        }
    }

    /// The model of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|model| model.name() == name)
    }

    /// Names of its distortion coefficients, in order.
    pub fn distortion(self) -> &'static [&'static str] {
        match self {
            CameraModel::Pinhole => &[],
            CameraModel::BrownConrady => &["k1", "k2", "p1", "p2", "k3"],
            CameraModel::Rational => &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
            CameraModel::KannalaBrandt => &["k1", "k2", "k3", "k4"],
        }
    }
}
