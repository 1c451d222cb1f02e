//! Names by index, and their natural order.
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Names in the order in which they were first met.
#[derive(Debug, Default)]
pub(super) struct Names {
    pub(super) list: Vec<String>,
    indices: BTreeMap<String, u32>,
}

impl Names {
    pub(super) fn index(&self, name: &str) -> Option<u32> {
        self.indices.get(name).copied()
    }

    /// The index of a name, which is added where it is new.
    pub(super) fn intern(&mut self, name: &str) -> u32 {
        if let Some(index) = self.index(name) {
            return index;
        }
        let index = self.list.len() as u32;
        self.indices.insert(name.to_owned(), index);
        self.list.push(name.to_owned());
        index
    }

    /// The names in natural order, and for every index the place of its name in it.
    pub(super) fn in_natural_order(self) -> (Vec<String>, Vec<u32>) {
        let mut order: Vec<usize> = (0..self.list.len()).collect();
        order.sort_by(|&a, &b| natural_order(&self.list[a], &self.list[b]));
        let mut places = vec![0; order.len()];
        for (place, &index) in order.iter().enumerate() {
            places[index] = place as u32;
        }
        let mut list = self.list;
        let sorted = order.into_iter().map(|index| std::mem::take(&mut list[index])).collect();
        (sorted, places)
    }
}

/// A name without what parameter paths cannot hold.
pub(super) fn tidy(name: &str) -> String {
    let name = name.replace(|c: char| c == '.' || c == '*' || c.is_control(), "_");
    if name.is_empty() { "unnamed".to_owned() } else { name }
}

/// A joint's name as parameter paths can hold it: LeRobot's `shoulder_pan.pos` is the position of `shoulder_pan`.
pub(super) fn joint_name(name: &str) -> String {
    tidy(name.strip_suffix(".pos").unwrap_or(name))
}

/// Digits count as numbers: `f2` comes before `f10`.
pub(crate) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while let (Some(l), Some(r)) = (left.chars().next(), right.chars().next()) {
        let order = if l.is_ascii_digit() && r.is_ascii_digit() {
            let (number_l, number_r) = (take_digits(&mut left), take_digits(&mut right));
            number_l.len().cmp(&number_r.len()).then_with(|| number_l.cmp(number_r))
        } else {
            (left, right) = (&left[l.len_utf8()..], &right[r.len_utf8()..]);
            l.cmp(&r)
        };
        if order.is_ne() {
            return order;
        }
    }
    // f1 and f01 are equal up to here: letter by letter decides.
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// Takes the digits off the front; leading zeros do not count.
fn take_digits<'a>(text: &mut &'a str) -> &'a str {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    *text = rest;
    digits.trim_start_matches('0')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_numbers_come_in_the_order_that_people_expect() {
        let expected = [
            "c",
            "c0_0",
            "c0_2",
            "c0_10",
            "c1_1",
            "f",
            "f01",
            "f1",
            "f2",
            "f10",
            "f10a",
            "f99999999999999999999999",
            "g",
        ];
        let mut sorted = expected.to_vec();
        sorted.reverse();
        sorted.sort_by(|a, b| natural_order(a, b));
        assert_eq!(sorted, expected);
    }
}
