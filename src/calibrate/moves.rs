//! A combination of numbers in words: what moves together, the largest parts first.
use crate::rig::Rig;

/// Parts that are named, and names that each part has at most.
const PARTS: usize = 3;
const NAMES: usize = 3;

/// Below this share of the largest, a part is only counted, and an axis or a name of a part is left out.
const LEAST: f64 = 0.1;

/// What moves as far as a length of 1 does, about: angles at 0.1 m, and pixels of a lens of 1000 px at 1 m.
const PER_RADIAN: f64 = 0.1; // m
const PER_PIXEL: f64 = 1e-3; // m

/// Numbers of one kind, such as the positions of cameras.
struct Part<'a> {
    /// What one of them is, and several.
    what: [&'static str; 2],
    /// What they are of, and how many of these the rig has.
    of: [&'static str; 2],
    count: usize,
    /// Of which, and how far each moves; the largest first. Empty for the base.
    names: Vec<(&'a str, f64)>,
    /// Along or about which axes.
    axes: Vec<(&'a str, f64)>,
    /// How far the largest moves.
    size: f64,
}

/// What moves together, as "the positions of both cameras along x together with the twist (alpha) of joint `elbow`, and 3 smaller parts".
///
/// `numbers`: parameter paths, a coordinate in brackets, and how far each moves, in its own unit.
pub(crate) fn in_words(rig: &Rig, numbers: &[(String, f64)]) -> String {
    let mut parts: Vec<Part<'_>> = Vec::new();
    for (path, weight) in numbers {
        let Some((part, name, axis, unit)) = of_path(rig, path) else { continue };
        let size = unit * weight.abs();
        let is_same = |other: &Part<'_>| other.what == part.what && other.of == part.of;
        let index = parts.iter().position(is_same).unwrap_or_else(|| {
            parts.push(part);
            parts.len() - 1
        });
        let part = &mut parts[index];
        part.size = part.size.max(size);
        for (list, entry) in [(&mut part.names, name), (&mut part.axes, axis)] {
            let Some(entry) = entry else { continue };
            match list.iter_mut().find(|(known, _)| *known == entry) {
                Some((_, largest)) => *largest = largest.max(size),
                None => list.push((entry, size)),
            }
        }
    }
    parts.sort_by(|one, other| other.size.total_cmp(&one.size));
    let largest = parts.first().map_or(0.0, |part| part.size);
    let named = parts.iter().take(PARTS).filter(|part| part.size >= LEAST * largest).map(Part::words);
    let named: Vec<String> = named.collect();
    let smaller = match parts.len() - named.len() {
        0 => String::new(),
        1 => ", and a smaller part".to_owned(),
        count => format!(", and {count} smaller parts"),
    };
    let Some((first, rest)) = named.split_first() else { return String::new() };
    let with = if rest.is_empty() { String::new() } else { format!(" together with {}", listed(rest)) };
    format!("{first}{with}{smaller}")
}

/// The part that a path belongs to, yet empty, with the name and the axis that it adds, and its unit.
fn of_path<'a>(rig: &Rig, path: &'a str) -> Option<(Part<'a>, Option<&'a str>, Option<&'a str>, f64)> {
    let with_axis = path.strip_suffix(')').and_then(|path| path.rsplit_once(" ("));
    let (path, axis) = with_axis.map_or((path, None), |(path, axis)| (path, Some(axis)));
    let (owner, field) = path.rsplit_once('.')?;
    let turns = axis.and_then(|axis| axis.strip_prefix("rotation "));
    let (what, unit): ([&str; 2], f64) = match field {
        "offset" => (["zero (offset)", "zeros (offset)"], PER_RADIAN),
        "d" => (["offset along the axis (d)", "offsets along the axes (d)"], 1.0),
        "a" => (["length (a)", "lengths (a)"], 1.0),
        "alpha" => (["twist (alpha)", "twists (alpha)"], PER_RADIAN),
        "beta" => (["tilt (beta)", "tilts (beta)"], PER_RADIAN),
        "fx" | "fy" => (["focal length", "focal lengths"], PER_PIXEL),
        "cx" | "cy" => (["image centre", "image centres"], PER_PIXEL),
        "distortion" => (["distortion", "distortions"], PER_RADIAN),
        _ if turns.is_some() => (["rotation", "rotations"], PER_RADIAN),
        _ => (["position", "positions"], 1.0),
    };
    let kinds = [
        ("robot.joints.", ["joint", "joints"], rig.robot.joints.len()),
        ("cameras.", ["camera", "cameras"], rig.cameras.len()),
        ("features.", ["feature", "features"], rig.features.len()),
    ];
    let named = kinds.into_iter().find_map(|(prefix, of, count)| Some((of, count, Some(owner.strip_prefix(prefix)?))));
    let (of, count, name) = named.unwrap_or((["the base"; 2], 1, None));
    let part = Part { what, of, count, names: Vec::new(), axes: Vec::new(), size: 0.0 };
    Some((part, name, turns.or(axis), unit))
}

impl Part<'_> {
    /// Such as "the positions of cameras `left` and `right` along x and y".
    fn words(&self) -> String {
        let counts = |(_, size): &&(&str, f64)| *size >= LEAST * self.size;
        let names: Vec<String> = self.names.iter().filter(counts).map(|(name, _)| format!("`{name}`")).collect();
        let several = usize::from(names.len() > 1);
        let (what, of) = (self.what[several], self.of[several]);
        let of = match names.len() {
            0 => of.to_owned(),
            2 if self.count == 2 => format!("both {of}"),
            all if all > 1 && all == self.count => format!("all {all} {of}"),
            few if few <= NAMES => format!("{of} {}", listed(&names)),
            many => format!("{many} of {} {of}", self.count),
        };
        let axes: Vec<String> = self.axes.iter().filter(counts).map(|(axis, _)| (*axis).to_owned()).collect();
        let preposition = if what.starts_with("rotation") { "about" } else { "along" };
        let axes = match axes.len() {
            1 | 2 => format!(" {preposition} {}", listed(&axes)),
            _ => String::new(),
        };
        format!("the {what} of {of}{axes}")
    }
}

/// "a, b and c"
fn listed(words: &[String]) -> String {
    match words.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => words.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::catalog;

    #[test]
    fn what_moves_together_is_told_by_its_largest_parts() {
        let rig = catalog::rig("ur5").unwrap();
        let numbers = |numbers: &[(&str, f64)]| -> Vec<(String, f64)> {
            numbers.iter().map(|(path, weight)| ((*path).to_owned(), *weight)).collect()
        };
        let both = numbers(&[
            ("cameras.left.pose (y)", 1.0),
            ("cameras.right.pose (y)", 0.97),
            ("cameras.left.pose (x)", 0.02),
            ("robot.joints.elbow.a", -0.5),
            ("robot.base (rotation z)", 1.5),
            ("cameras.left.fx", 90.0),
            ("features.f0.xyz", 0.01),
        ]);
        assert_eq!(
            in_words(&rig, &both),
            "the positions of both cameras along y together with the length (a) of joint `elbow` and the rotation of the base about z, and 2 \
             smaller parts"
        );
        // A radian moves more than a metre of the features, which are centimetres away.
        let mut turned = numbers(&[("robot.joints.wrist_3.alpha", 1.0), ("cameras.right.pose (rotation x)", 1e-3)]);
        turned.extend((0..8).flat_map(|feature| vec![(format!("features.f{feature}.xyz"), 0.06); 2]));
        assert_eq!(
            in_words(&rig, &turned),
            "the twist (alpha) of joint `wrist_3` together with the positions of 8 of 12 features, and a smaller part"
        );
        assert_eq!(in_words(&rig, &numbers(&[("robot.base (x)", 1.0)])), "the position of the base along x");
        assert_eq!(in_words(&rig, &[]), "");
    }
}
