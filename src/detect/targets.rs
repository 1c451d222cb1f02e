//! Where a board or a tag is before a camera, from the corners that are seen of it.
use super::Pattern;
use crate::camera::PARAMETERS;
use crate::geometry::resect;
use crate::recording::{Detection, RecordedCamera, Recording, TargetDetection};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Fewest corners of a target.
const LEAST: usize = 4;

/// A pose is told from its mirror where the mirror fits so many times worse.
const CLEARER: f64 = 2.0;

impl Pattern {
    /// The target that a feature is of, and where it is in the target's frame, in sides of a tag or of the board's squares: x along rows, y down
    /// the columns, as printed (z away from who looks at it), from the centre of a tag or from corner 0/0 of a board.
    pub fn place(&self, feature: &str) -> Option<(String, [f64; 2])> {
        let (name, corner) = feature.rsplit_once(if matches!(self, Pattern::Tags(_)) { '/' } else { ':' })?;
        match self {
            Pattern::Tags(family) => {
                let corner = corner.parse().ok().filter(|corner| *corner < 4)?;
                let is_of_it = name.split_once(':').is_some_and(|(of, _)| of == family.name());
                is_of_it.then(|| (name.to_owned(), family.place(corner)))
            }
            Pattern::Checkerboard(_) | Pattern::Charuco(_) => {
                let (row, column) = corner.split_once('/').filter(|_| name == "corner")?;
                Some(("board".to_owned(), [column.parse().ok()?, row.parse().ok()?]))
            }
        }
    }
}

impl Recording {
    /// Adds the poses of targets whose size is known: `camera_from_target`, where the camera's intrinsics are known and four corners are seen or
    /// more. `side`: of a tag or of a board's squares [m].
    ///
    /// Says how many are left out, since a mirrored pose fits hardly worse, and which cameras have no intrinsics.
    pub fn add_targets(&mut self, pattern: &Pattern, side: f64) -> (usize, Vec<String>) {
        let lenses: Vec<_> = self.cameras.iter().map(parameters).collect();
        let blind = self.cameras.iter().zip(&lenses).filter(|(_, lens)| lens.is_none());
        let blind = blind.map(|(camera, _)| camera.name.clone()).collect();
        let mut unclear = 0;
        for sample in &mut self.samples {
            let mut found: BTreeMap<(u32, String), Sighted> = BTreeMap::new();
            for Detection { camera, feature, pixel } in &sample.pixels {
                let Some(lens) = &lenses[*camera as usize] else { continue };
                let bearing = self.cameras[*camera as usize].model.unwrap_or_default().unproject(lens, *pixel);
                let place = pattern.place(&self.features[*feature as usize]);
                if let (Some((target, [x, y])), Some(bearing)) = (place, bearing) {
                    let seen = found.entry((*camera, target)).or_default();
                    seen.points.push(Vector3::new(x * side, y * side, 0.0));
                    seen.bearings.push(bearing);
                }
            }
            for ((camera, target), seen) in found {
                if seen.points.len() < LEAST {
                    continue;
                }
                match seen.pose() {
                    Some(pose) => sample.targets.push(TargetDetection { camera, target, pose, covariance: None }),
                    None => unclear += 1,
                }
            }
        }
        (unclear, blind)
    }
}

/// Corners of one target: where they are in its frame, and the unit directions that they are seen in.
#[derive(Default)]
struct Sighted {
    points: Vec<Vector3<f64>>,
    bearings: Vec<Vector3<f64>>,
}

impl Sighted {
    /// The pose that fits clearly better than any other.
    fn pose(&self) -> Option<Pose> {
        let poses = resect(&self.points, &self.bearings);
        let error = |pose: &Pose| {
            let seen = self.points.iter().zip(&self.bearings);
            let off = seen.map(|(point, bearing)| (pose.transform(point).normalize() - bearing).norm_squared());
            off.sum::<f64>().sqrt()
        };
        let best = *poses.first()?;
        poses.get(1).is_none_or(|other| error(other) > CLEARER * error(&best)).then_some(best)
    }
}

fn parameters(camera: &RecordedCamera) -> Option<[f64; PARAMETERS]> {
    let mut parameters = [0.0; PARAMETERS];
    let known = [camera.fx?, camera.fy?, camera.cx?, camera.cy?];
    parameters[..4].copy_from_slice(&known);
    for (place, value) in parameters[4..].iter_mut().zip(camera.distortion.iter().flatten()) {
        *place = *value;
    }
    Some(parameters)
}
