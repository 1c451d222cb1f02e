//! A combination of numbers in words: the largest terms, and what moves alike as one.
use crate::rig::Rig;

/// Terms that are shown.
const TERMS: usize = 5;

/// A term that rounds to nothing beside the largest, which is 1, is only counted.
const LEAST: f64 = 0.005;

/// Numbers move alike where they differ by less than this share of the largest.
const ALIKE: f64 = 0.1;

/// The largest terms, and how many more there are. What all cameras or all features have alike is one term.
pub(super) fn together(rig: &Rig, numbers: &[(String, f64)]) -> String {
    let mut left: Vec<&(String, f64)> = numbers.iter().collect();
    let mut terms = Vec::new();
    while terms.len() < TERMS && left.first().is_some_and(|(_, weight)| terms.is_empty() || weight.abs() >= LEAST) {
        let (path, weight) = left[0];
        let (all, members) = alike(rig, &left).unwrap_or_else(|| (path.clone(), vec![0]));
        terms.push(format!("{weight:+.2} {all}"));
        let mut index = 0;
        left.retain(|_| {
            index += 1;
            !members.contains(&(index - 1))
        });
    }
    if !left.is_empty() {
        terms.push(format!("and {} more", left.len()));
    }
    terms.join(", ")
}

/// What moves as the first does, in words, and which terms these are; `None` where not all of its kind do.
fn alike(rig: &Rig, numbers: &[&(String, f64)]) -> Option<(String, Vec<usize>)> {
    let (path, weight) = numbers[0];
    let rest = path.strip_prefix("cameras.").or(path.strip_prefix("features."))?;
    let is_camera = path.starts_with("cameras.");
    let names: Vec<&str> = if is_camera {
        rig.cameras.iter().map(|camera| camera.name.as_str()).collect()
    } else {
        rig.features.iter().map(|feature| feature.name.as_str()).collect()
    };
    let kind = names.iter().find_map(|name| rest.strip_prefix(*name)?.strip_prefix('.'))?;
    let prefix = if is_camera { "cameras" } else { "features" };
    let of_name = |name: &&str| {
        let wanted = format!("{prefix}.{name}.{kind}");
        numbers.iter().position(|(path, other)| *path == wanted && (other - weight).abs() < ALIKE * weight.abs())
    };
    let members = names.iter().map(of_name).collect::<Option<Vec<usize>>>()?;
    let words = match kind.strip_prefix("pose (").and_then(|axis| axis.strip_suffix(')')) {
        Some(axis) => match axis.strip_prefix("rotation ") {
            Some(axis) => format!("the rotation about {axis} of all cameras"),
            None => format!("all camera positions along {axis}"),
        },
        None if kind == "xyz" => "one coordinate of all features".to_owned(),
        None => format!("{kind} of all {prefix}"),
    };
    (members.len() > 1).then_some((words, members))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::catalog;

    #[test]
    fn what_all_cameras_have_alike_is_one_term_and_small_terms_are_counted() {
        let rig = catalog::rig("ur5").unwrap();
        let number = |path: &str, weight| (path.to_owned(), weight);
        let mut numbers = vec![
            number("cameras.left.pose (y)", 1.0),
            number("cameras.right.pose (y)", 0.97),
            number("robot.joints.elbow.a", -0.5),
            number("cameras.left.pose (x)", 0.3),
            number("cameras.right.pose (x)", -0.3),
        ];
        numbers.extend((0..9).map(|feature| number(&format!("features.f{feature}.xyz"), 0.2 - 0.02 * feature as f64)));
        let words = together(&rig, &numbers);
        assert_eq!(
            words,
            "+1.00 all camera positions along y, -0.50 robot.joints.elbow.a, +0.30 cameras.left.pose (x), -0.30 cameras.right.pose (x), \
             +0.20 features.f0.xyz, and 8 more"
        );
    }
}
