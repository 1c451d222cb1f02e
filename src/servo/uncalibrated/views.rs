//! Cameras at one place leave one point of view.
use super::signals::Row;

/// Standard deviations within which two cameras see the same.
const SAME: f64 = 4.0;

/// Noise below this is taken for this [px].
const LEAST_SD: f64 = 1e-6;

/// Two cameras that see the same errors in all of their rows, three or more.
pub(super) fn coinciding(rows: &[Row], errors: &[f64]) -> Option<[usize; 2]> {
    let of = |camera: usize| (0..rows.len()).filter(move |row| rows[*row].camera == camera);
    let same =
        |(a, b): (usize, usize)| (errors[a] - errors[b]).abs() <= SAME * rows[a].sd.hypot(rows[b].sd).max(LEAST_SD);
    let cameras = rows.iter().map(|row| row.camera + 1).max().unwrap_or(0);
    let mut pairs = (0..cameras).flat_map(|first| (first + 1..cameras).map(move |second| [first, second]));
    pairs.find(|&[first, second]| {
        let n = of(first).count();
        n >= 3 && n == of(second).count() && of(first).zip(of(second)).all(same)
    })
}
