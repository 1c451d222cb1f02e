//! Cameras at one place leave one point of view.
use super::signals::Row;
use std::collections::BTreeSet;

/// Standard deviations within which two cameras see the same.
const SAME: f64 = 4.0;

/// Noise below this is taken for this [px].
const LEAST_SD: f64 = 1e-6;

/// Two cameras that see the same errors in all of their rows, three or more; errors that are nothing but noise tell nothing.
pub(super) fn coinciding(rows: &[Row], errors: &[f64]) -> Option<[usize; 2]> {
    let of = |camera: usize| (0..rows.len()).filter(move |row| rows[*row].camera == camera);
    let within = |error: f64, sd: f64| error.abs() <= SAME * sd.max(LEAST_SD);
    let same = |(a, b): (usize, usize)| within(errors[a] - errors[b], rows[a].sd.hypot(rows[b].sd));
    let tells = |camera: usize| of(camera).any(|row| !within(errors[row], rows[row].sd));
    let cameras: Vec<usize> = rows.iter().map(|row| row.camera).collect::<BTreeSet<_>>().into_iter().collect();
    let mut pairs =
        cameras.iter().enumerate().flat_map(|(i, &first)| cameras[i + 1..].iter().map(move |&second| [first, second]));
    pairs.find(|&[first, second]| {
        let n = of(first).count();
        n >= 3 && n == of(second).count() && tells(first) && of(first).zip(of(second)).all(same)
    })
}
