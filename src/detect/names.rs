//! Names of images, which may be numbers or times.
use crate::recording::{LATEST, are_far_apart, natural_order, unit_of_date};
use std::cmp::Ordering;

/// What the names of all images are together.
pub(super) struct Names {
    /// True where all are numbers.
    are_numbers: bool,
    /// The seconds that one unit of the numbers takes; `None` where they are no times, or not all in one unit.
    unit: Option<f64>,
}

impl Names {
    pub(super) fn new<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Names {
        let numbers = names.clone().filter_map(number);
        let unit = |number: f64| match unit_of_date(number) {
            Some((_, unit)) => Some(unit),
            None => (number < LATEST).then_some(1.0),
        };
        let first = numbers.clone().next().and_then(unit);
        let is_of_all = |first: &f64| numbers.clone().all(|number| unit(number) == Some(*first));
        let is_near = |unit: &f64| {
            let mut times: Vec<f64> = numbers.clone().map(|number| number * unit).collect();
            times.sort_by(f64::total_cmp);
            *unit == 1.0 || !are_far_apart(times.into_iter())
        };
        Names {
            are_numbers: names.clone().all(|name| number(name).is_some()),
            unit: first.filter(is_of_all).filter(is_near),
        }
    }

    /// By number where all are numbers, 9.25 before 9.5 and 99 before 100; otherwise in natural order.
    pub(super) fn order(&self, a: &str, b: &str) -> Ordering {
        match (number(a), number(b)) {
            // Beyond what a float tells apart, digits are counted.
            (Some(one), Some(other)) if self.are_numbers => one.total_cmp(&other).then_with(|| natural_order(a, b)),
            _ => natural_order(a, b),
        }
    }

    /// The time that a name is [s]: `1700000000.25`, or a count of s, ms, µs or ns since 1970, whatever makes it a date of this century.
    pub(super) fn time(&self, name: &str) -> Option<f64> {
        Some(number(name)? * self.unit?)
    }
}

/// The number that a name is: digits, and a point among them at most.
fn number(name: &str) -> Option<f64> {
    let is_number = !name.is_empty() && name.chars().all(|c| c.is_ascii_digit() || c == '.');
    name.parse().ok().filter(|_| is_number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(names: &[&'static str]) -> Vec<&'static str> {
        let all = Names::new(names.iter().copied());
        let mut sorted = names.to_vec();
        sorted.sort_by(|a, b| all.order(a, b));
        sorted
    }

    #[test]
    fn numbers_are_in_their_order_and_other_names_in_that_of_people() {
        assert_eq!(sorted(&["100", "99", "9.5", "9.25"]), ["9.25", "9.5", "99", "100"]);
        assert_eq!(sorted(&["shot-10", "shot-9", "9.5", "9.25"]), ["9.5", "9.25", "shot-9", "shot-10"]);
        let near = ["1700000000000000001", "1700000000000000000"];
        assert_eq!(sorted(&near), ["1700000000000000000", "1700000000000000001"]);
    }

    #[test]
    fn times_are_in_one_unit_or_none() {
        let time = |names: &[&str], name: &str| Names::new(names.iter().copied()).time(name);
        assert_eq!(time(&["99", "100"], "100"), Some(100.0));
        assert_eq!(time(&["1700000000000", "1700000000500"], "1700000000500"), Some(1_700_000_000.5));
        assert_eq!(time(&["1700000000000", "99"], "99"), None);
        // Nanoseconds of a clock that began with the recording are no seconds, and nothing says what they are.
        assert_eq!(time(&["900000000", "1000000000000"], "900000000"), None);
        assert_eq!(time(&["1200000000000", "1200033000000", "1200066000000"], "1200033000000"), None);
        assert_eq!(time(&["shot", "0.5"], "shot"), None);
    }
}
