//! Where a robot was at the moments at which images were taken.
use super::groups::Group;
use super::track::At;
use handeye_solvers::Pose;

/// Joints and tip poses at some moments.
pub(super) struct Whereabouts {
    /// [ns], sorted.
    pub moments: Vec<i64>,
    /// At each of them; `None` where nothing was read around it.
    pub joints: Vec<Option<At<Vec<f64>>>>,
    pub poses: Vec<Option<At<Pose>>>,
}

/// Motion between two images that is seen in them [rad, m]: what is less is a tenth of a pixel or so.
const SEEN: f64 = 2e-4;

impl Whereabouts {
    /// True where it moved between two of the moments.
    pub fn moved(&self, first: i64, last: i64) -> bool {
        let place = |time: i64| self.moments.binary_search(&time).ok();
        let (Some(first), Some(last)) = (place(first), place(last)) else { return false };
        let turned = |(one, other): (&At<Vec<f64>>, &At<Vec<f64>>)| {
            one.value.iter().zip(&other.value).any(|(one, other)| (one - other).abs() > SEEN)
        };
        let carried = |(one, other): (&At<Pose>, &At<Pose>)| {
            let shift = other.value.translation - one.value.translation;
            one.value.angle_to(&other.value) > SEEN || shift.norm() > SEEN
        };
        self.joints[first].as_ref().zip(self.joints[last].as_ref()).is_some_and(turned)
            || self.poses[first].as_ref().zip(self.poses[last].as_ref()).is_some_and(carried)
    }

    /// Those of groups of images, whose times are among the moments, in place of the moments.
    pub fn of(&self, groups: &[Group]) -> Whereabouts {
        let place = |group: &Group| self.moments.binary_search(&group.time).ok();
        let places: Vec<usize> = groups.iter().filter_map(place).collect();
        Whereabouts {
            moments: groups.iter().map(|group| group.time).collect(),
            joints: places.iter().map(|&place| self.joints[place].clone()).collect(),
            poses: places.iter().map(|&place| self.poses[place].clone()).collect(),
        }
    }
}

/// What has to be said of groups that were taken apart.
pub(super) fn note_on_apart(apart: usize) -> Option<String> {
    (apart > 0).then(|| {
        format!(
            "{apart} times the robot moved by more than {} mrad or mm from one camera's image to the next, or its readings are as noisy, so that each is a sample of its own, with the joints of its own time",
            1e3 * SEEN
        )
    })
}
