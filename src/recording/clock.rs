//! The unit of times that do not say it.

/// Units of times: what they are called, how names of columns end that are in them, and their seconds.
pub(super) const UNITS: [(&str, &str, f64); 4] = [
    ("seconds", "_s", 1.0),
    ("milliseconds", "_ms", 1e-3),
    ("microseconds", "_us", 1e-6),
    ("nanoseconds", "_ns", 1e-9),
];

/// Beyond it a number is no time in seconds [s]: it would be after the year 2286.
pub(crate) const LATEST: f64 = 1e10;

/// The years 2000 to 2100 [s since 1970]: a number of a thousand times as many or more is not between them in any unit but its own.
const DATES: std::ops::Range<f64> = 946_684_800.0..4_102_444_800.0;

/// A time as it is counted inside [ns].
pub(super) fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

/// A time as recordings and messages tell it [s].
pub(super) fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 / 1e9
}

/// The unit in which a number is a date since 1970: its name and its seconds.
pub(crate) fn unit_of_date(number: f64) -> Option<(&'static str, f64)> {
    UNITS.iter().find(|(_, _, seconds)| DATES.contains(&(number * seconds))).map(|(name, _, seconds)| (*name, *seconds))
}

/// What a unit of so many seconds is called.
pub(super) fn name_of_unit(seconds: f64) -> &'static str {
    UNITS.iter().find(|(_, _, unit)| *unit == seconds).map_or("units", |(name, ..)| name)
}

/// True where most times are a quarter of an hour or more after the one before: a clock that counts since its start was taken for a date.
pub(crate) fn are_far_apart(times: impl Iterator<Item = f64>) -> bool {
    const FAR: f64 = 900.0;
    let times: Vec<f64> = times.collect();
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0);
    let (far, near): (Vec<f64>, Vec<f64>) = steps.partition(|step| *step > FAR);
    far.len() > near.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_shows_its_unit_and_other_numbers_show_none() {
        for (number, unit) in [(1.7e9, 1.0), (1.7e12, 1e-3), (1.7e15, 1e-6), (1.7e18, 1e-9)] {
            assert_eq!(unit_of_date(number).map(|(_, seconds)| seconds), Some(unit), "{number}");
        }
        for number in [0.0, 99.0, 1.2e11, 1e16, 1e19, f64::NAN] {
            assert_eq!(unit_of_date(number), None, "{number}");
        }
    }
}
