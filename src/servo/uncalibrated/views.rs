//! Cameras at one place leave one point of view.
use super::signals::Row;
use std::collections::BTreeSet;

/// Standard deviations within which two cameras see the same.
const SAME: f64 = 4.0;

/// Errors tell whether cameras stand apart where they are this many standard deviations, root mean square: nearer to the goal all cameras
/// see next to nothing.
const TELLING: f64 = 20.0;

/// Noise below this is taken for this [px].
const LEAST_SD: f64 = 1e-6;

/// Two cameras that see the same errors in all of their rows, three or more; errors near the noise tell nothing.
pub(super) fn coinciding(rows: &[Row], errors: &[f64]) -> Option<[usize; 2]> {
    let of = |camera: usize| (0..rows.len()).filter(move |row| rows[*row].camera == camera);
    let within = |error: f64, sd: f64| error.abs() <= SAME * sd.max(LEAST_SD);
    let same = |(a, b): (usize, usize)| within(errors[a] - errors[b], rows[a].sd.hypot(rows[b].sd));
    let tells = |camera: usize| {
        let squares: f64 = of(camera).map(|row| (errors[row] / rows[row].sd.max(LEAST_SD)).powi(2)).sum();
        squares > TELLING * TELLING * of(camera).count() as f64
    };
    let cameras: Vec<usize> = rows.iter().map(|row| row.camera).collect::<BTreeSet<_>>().into_iter().collect();
    let mut pairs =
        cameras.iter().enumerate().flat_map(|(i, &first)| cameras[i + 1..].iter().map(move |&second| [first, second]));
    pairs.find(|&[first, second]| {
        let n = of(first).count();
        n >= 3 && n == of(second).count() && tells(first) && of(first).zip(of(second)).all(same)
    })
}
