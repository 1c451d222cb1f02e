//! Points, lines and motions in words: by the features that they go through.
use super::motion::{Displacement, Motion};
use super::problem::Problem;
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Where the features are with the hand at a placement; those of the hand first, and no place twice.
pub(super) struct Names {
    places: Vec<(String, Vector3<f64>)>,
    /// Distances below this are none [m].
    near: f64,
}

impl Names {
    pub fn new(problem: &Problem, pose: &Pose) -> Self {
        let near = 1e-3 * problem.size;
        let mut names = Names { places: Vec::new(), near };
        let features = problem.task.features();
        let mut order: Vec<usize> = (0..features.len()).collect();
        order.sort_by_key(|index| features[*index].place.name() != "hand");
        for index in order {
            let Some(place) = problem.in_world(index, pose) else { continue };
            if names.at(&place).is_none() {
                names.places.push((features[index].name.clone(), place));
            }
        }
        names
    }

    /// Every place [m].
    pub fn points(&self) -> Vec<Vector3<f64>> {
        self.places.iter().map(|(_, place)| *place).collect()
    }

    fn at(&self, point: &Vector3<f64>) -> Option<&str> {
        self.places.iter().find(|(_, place)| (place - point).norm() < self.near).map(|(name, _)| name.as_str())
    }

    pub fn point(&self, point: &Vector3<f64>) -> String {
        self.at(point).map_or_else(|| format!("{} m", triple(point)), |name| format!("`{name}`"))
    }

    /// Features on a line, the two that are farthest apart.
    fn on_line(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> Option<[&str; 2]> {
        let beside = |place: &Vector3<f64>| direction.cross(&(place - point)).norm();
        let along = |place: &Vector3<f64>| direction.dot(&(place - point));
        let on = || self.places.iter().filter(|(_, place)| beside(place) < self.near);
        let first = on().min_by(|a, b| along(&a.1).total_cmp(&along(&b.1)))?;
        let last = on().max_by(|a, b| along(&a.1).total_cmp(&along(&b.1)))?;
        (along(&last.1) - along(&first.1) > 10.0 * self.near).then_some([&first.0, &last.0])
    }

    /// A direction, by two features that stand in it.
    pub fn direction(&self, direction: &Vector3<f64>) -> String {
        let direction = upright(direction);
        let line = self.places.iter().find_map(|(_, place)| self.on_line(place, &direction));
        let numbers = triple(&direction);
        line.map_or(numbers, |[from, to]| format!("the line through `{from}` and `{to}`"))
    }

    fn axis(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> String {
        let direction = upright(direction);
        if let Some([from, to]) = self.on_line(point, &direction) {
            return format!("the line through `{from}` and `{to}`");
        }
        // An axis is told by the feature that it goes through, or by its point next to the middle of the features.
        let through = self.places.iter().find(|(_, place)| direction.cross(&(place - point)).norm() < self.near);
        let place = through.map_or_else(
            || {
                let middle = self.points().iter().sum::<Vector3<f64>>() / self.places.len().max(1) as f64;
                self.point(&(point + direction * direction.dot(&(middle - point))))
            },
            |(name, _)| format!("`{name}`"),
        );
        format!("the axis through {place} along {}", self.direction(&direction))
    }

    pub fn motion(&self, motion: &Motion) -> String {
        match motion {
            Motion::Translation { direction } => format!("translation along {}", self.direction(direction)),
            Motion::Rotation { point, direction } => format!("rotation about {}", self.axis(point, direction)),
            Motion::Screw { point, direction, pitch } => {
                let per_turn = 1e3 * std::f64::consts::TAU * pitch;
                format!("screw about {}, {per_turn:.1} mm a turn", self.axis(point, direction))
            }
        }
    }

    pub fn displacement(&self, by: &Displacement) -> String {
        if by.angle < 1e-3 {
            return format!("moved by {:.1} mm along {}", 1e3 * by.along, self.direction(&by.direction));
        }
        let turned = format!("turned by {:.1}° about {}", by.angle.to_degrees(), self.axis(&by.point, &by.direction));
        if by.along.abs() < self.near {
            return turned;
        }
        format!("{turned}, and moved by {:.1} mm along it", 1e3 * by.along.abs())
    }
}

/// The direction or its opposite, whichever has its largest coordinate positive: an axis has no sign.
fn upright(direction: &Vector3<f64>) -> Vector3<f64> {
    let unit = direction.normalize();
    if unit[unit.iamax()] < 0.0 { -unit } else { unit }
}

fn triple(vector: &Vector3<f64>) -> String {
    let clean = |value: f64| if value.abs() < 5e-4 { 0.0 } else { value };
    format!("[{:.3}, {:.3}, {:.3}]", clean(vector.x), clean(vector.y), clean(vector.z))
}
