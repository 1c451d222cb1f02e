//! The pose of a rigid set of points from rays that come from several places: one set, all cameras at once.
use super::object_space::ObjectSpace;
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// The pose `rays_from_points` that brings `points` nearest to the rays along which they are seen, in one piece.
///
/// `origins`, `directions`: a point of each ray and its unit direction, in the rays' frame, by index. Closed form and a descent from
/// it; the error is Σ (distance of the point from its ray)². `None` where the rays come from one place or are too few for that:
/// [`poses_from_rays`] and [`super::resect`] search further.
pub fn pose_from_rays(points: &[Vector3<f64>], origins: &[Vector3<f64>], directions: &[Vector3<f64>]) -> Option<Pose> {
    let (scaled, frame) = Scaled::new(points, origins, directions)?;
    let form = ObjectSpace::new(&scaled.points, &scaled.origins, directions)?;
    Some(frame.back(&form.pose(form.linear()?)))
}

/// Every pose at which that error has a minimum, in no order: about 20 times the work.
pub fn poses_from_rays(points: &[Vector3<f64>], origins: &[Vector3<f64>], directions: &[Vector3<f64>]) -> Vec<Pose> {
    let Some((scaled, frame)) = Scaled::new(points, origins, directions) else { return Vec::new() };
    let Some(form) = ObjectSpace::new(&scaled.points, &scaled.origins, directions) else { return Vec::new() };
    form.minima().into_iter().map(|rotation| frame.back(&form.pose(rotation))).collect()
}

/// Points centred and scaled to a size of 1, rays likewise, so that nothing depends on frames and units.
struct Scaled {
    points: Vec<Vector3<f64>>,
    origins: Vec<Vector3<f64>>,
}

/// The way back.
struct Frame {
    mean: Vector3<f64>,
    centre: Vector3<f64>,
    size: f64,
}

impl Scaled {
    fn new(points: &[Vector3<f64>], origins: &[Vector3<f64>], directions: &[Vector3<f64>]) -> Option<(Scaled, Frame)> {
        if points.len() < 3 || points.len() != origins.len() || points.len() != directions.len() {
            return None;
        }
        let n = points.len() as f64;
        let mean = points.iter().sum::<Vector3<f64>>() / n;
        let centre = origins.iter().sum::<Vector3<f64>>() / n;
        let size = (points.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / n).sqrt();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let scaled = Scaled {
            points: points.iter().map(|p| (p - mean) / size).collect(),
            origins: origins.iter().map(|c| (c - centre) / size).collect(),
        };
        Some((scaled, Frame { mean, centre, size }))
    }
}

impl Frame {
    fn back(&self, pose: &Pose) -> Pose {
        let translation = pose.translation * self.size + self.centre - pose.rotation * self.mean;
        Pose { rotation: pose.rotation, translation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::{Random, distance};

    /// Points in a set of a size of 1, each seen from one of `cameras` places about 4 away.
    fn scene(seed: u64, n: usize, cameras: usize, flat: f64) -> (Pose, [Vec<Vector3<f64>>; 3]) {
        let mut random = Random::new(seed);
        let truth = Pose::new(random.vector(1.8), random.vector(2.0));
        let places: Vec<Vector3<f64>> =
            (0..cameras).map(|_| truth.translation + random.vector(1.0).normalize() * 4.0).collect();
        let mut all: [Vec<Vector3<f64>>; 3] = Default::default();
        for i in 0..n {
            let point = random.vector(1.0).component_mul(&Vector3::new(1.0, 1.0, flat));
            let origin = places[i % cameras];
            let seen = truth.transform(&point) - origin;
            for (list, value) in all.iter_mut().zip([point, origin, seen.normalize()]) {
                list.push(value);
            }
        }
        (truth, all)
    }

    #[test]
    fn rays_from_several_places_give_the_exact_pose_in_one_go() {
        for (n, cameras, flat) in [(8, 2, 1.0), (24, 2, 1.0), (24, 2, 0.0), (9, 3, 1.0), (12, 4, 0.0)] {
            let mut right = 0;
            for seed in 0..100 {
                let (truth, [points, origins, directions]) = scene(seed, n, cameras, flat);
                let found = pose_from_rays(&points, &origins, &directions);
                right += usize::from(found.is_some_and(|pose| distance(&pose, &truth) < 1e-6));
            }
            assert!(right >= 98, "{right} of 100 with {n} points from {cameras} places, flat {flat}");
        }
    }

    #[test]
    fn few_rays_and_rays_from_one_place_have_the_truth_among_their_minima() {
        for (n, cameras) in [(4, 2), (4, 4), (6, 1), (5, 2)] {
            let mut right = 0;
            for seed in 0..100 {
                let (truth, [points, origins, directions]) = scene(seed, n, cameras, 1.0);
                let found = poses_from_rays(&points, &origins, &directions);
                right += usize::from(found.iter().any(|pose| distance(pose, &truth) < 1e-5));
            }
            assert!(right >= 95, "{right} of 100 with {n} points from {cameras} places");
        }
        let (_, [points, _, directions]) = scene(1, 9, 1, 1.0);
        assert_eq!(pose_from_rays(&points, &[Vector3::zeros(); 9], &directions), None);
        assert_eq!(pose_from_rays(&points[..2], &[Vector3::x(); 2], &directions[..2]), None);
        assert!(poses_from_rays(&points, &[Vector3::repeat(f64::NAN); 9], &directions).is_empty());
    }
}
