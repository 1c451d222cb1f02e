//! Whether the target of a task has moved by itself.
use super::image_tasks::{ImageTask, Place, Seen};

/// What was seen of a target when it had last moved.
pub(super) struct TargetWatch {
    was: Seen,
}

/// A target has moved where a coordinate of it is this many standard deviations of a difference from where it was.
const MOVED: f64 = 5.0;

impl TargetWatch {
    /// Of a target that is now where it is seen.
    pub fn new(seen: &Seen) -> Self {
        TargetWatch { was: seen.clone() }
    }

    /// By how much the rows have changed because the target has moved; `None` where it has not. `carried`: cameras that move with the hand,
    /// in which it moves by itself.
    pub fn changes(&mut self, task: &ImageTask, carried: &[bool], seen: &Seen) -> Option<Vec<f64>> {
        let (mut before, mut moved, trackers) = (seen.clone(), false, task.trackers());
        for camera in (0..task.cameras().len()).filter(|camera| carried.get(*camera) != Some(&true)) {
            for (feature, _) in task.features().iter().enumerate().filter(|(_, f)| matches!(f.place, Place::Target(_)))
            {
                let pixel = (&mut self.was.pixels[camera][feature], &mut before.pixels[camera][feature]);
                moved |= compare(pixel, trackers.pixels);
                let point = (&mut self.was.points[camera][feature], &mut before.points[camera][feature]);
                moved |= compare(point, trackers.points);
            }
        }
        if !moved {
            return None;
        }
        let (now, then) = (task.values(seen), task.values(&before));
        for camera in 0..task.cameras().len() {
            take_over(&mut self.was.pixels[camera], &seen.pixels[camera]);
            take_over(&mut self.was.points[camera], &seen.points[camera]);
        }
        let change = |(now, then): (&f64, &f64)| Some(now - then).filter(|change| change.is_finite()).unwrap_or(0.0);
        Some(now.iter().zip(&then).map(change).collect())
    }
}

/// Puts where it was in place of where it is; what was not seen before was where it is. True where they are apart.
fn compare<const N: usize>((was, now): (&mut [f64; N], &mut [f64; N]), sd: f64) -> bool {
    if was.iter().any(|x| x.is_nan()) {
        *was = *now;
    }
    let most = MOVED * 2.0_f64.sqrt() * sd.max(f64::MIN_POSITIVE);
    let moved = was.iter().zip(now.iter()).any(|(was, now)| (now - was).abs() > most);
    *now = *was;
    moved
}

/// Takes over what is seen.
fn take_over<const N: usize>(was: &mut [[f64; N]], now: &[[f64; N]]) {
    for (was, now) in was.iter_mut().zip(now).filter(|(_, now)| now.iter().all(|x| x.is_finite())) {
        *was = *now;
    }
}
