//! Which joints of a recording are those of a rig: drivers put a prefix before all of an arm's names, or a suffix behind them.

/// Places of a rig's joints among those of a recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Places {
    /// All are there, at these places.
    Found(Vec<usize>),
    /// All are there more than once, as these, of the rig's first joint.
    Several(Vec<String>),
    /// Some are not there.
    Missing,
}

/// Where the names of a rig stand among those of a recording: as they are, or all of them within the same prefix and suffix, or without those
/// that they have in common, which end and begin where words do: `elbow` is `left_elbow_joint` where `wrist` is `left_wrist_joint`.
pub(crate) fn places(rig: &[String], recording: &[String]) -> Places {
    let Some(first) = rig.first() else { return Places::Missing };
    let place_of = |name: &str| recording.iter().position(|found| found == name);
    if let Some(places) = rig.iter().map(|name| place_of(name)).collect() {
        return Places::Found(places);
    }
    let mut candidates: Vec<Vec<usize>> = Vec::new();
    for found in recording {
        let longer = around(found, first).into_iter().map(|(before, after)| {
            rig.iter().map(|name| place_of(&format!("{before}{name}{after}"))).collect::<Option<Vec<usize>>>()
        });
        let shorter = around(first, found).into_iter().map(|(before, after)| {
            let bare = |name: &String| name.strip_prefix(before)?.strip_suffix(after).and_then(place_of);
            rig.iter().map(bare).collect::<Option<Vec<usize>>>()
        });
        for places in longer.chain(shorter).flatten() {
            if !candidates.contains(&places) {
                candidates.push(places);
            }
        }
    }
    match candidates.as_slice() {
        [] => Places::Missing,
        [_] => Places::Found(candidates.swap_remove(0)),
        several => Places::Several(several.iter().map(|places| recording[places[0]].clone()).collect()),
    }
}

/// True where a recording's joints are those of a rig, in its order.
pub(super) fn are_those(rig: &[String], recording: &[String]) -> bool {
    matches!(places(rig, recording), Places::Found(places) if places.iter().copied().eq(0..recording.len()))
}

/// What has to be said where joints that are known are there more than once; `first`: what the first of them may be.
pub(super) fn several(first: &[String]) -> String {
    let first = first.join(" or ");
    format!("several joints may be meant, whose first would be {first}: --joints names those of one robot")
}

/// What stands before and after a name wherever another holds it as whole words.
fn around<'a>(long: &'a str, name: &str) -> Vec<(&'a str, &'a str)> {
    let is_apart = |text: Option<char>| text.is_none_or(|letter| !letter.is_alphanumeric());
    long.match_indices(name)
        .map(|(at, _)| (&long[..at], &long[at + name.len()..]))
        .filter(|(before, after)| is_apart(before.chars().next_back()) && is_apart(after.chars().next()))
        .filter(|(before, after)| !name.is_empty() && (!before.is_empty() || !after.is_empty()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &str) -> Vec<String> {
        names.split(' ').map(str::to_owned).collect()
    }

    fn check(rig: &str, recording: &str, places: &[usize]) {
        assert_eq!(super::places(&names(rig), &names(recording)), Places::Found(places.to_vec()), "{rig}: {recording}");
    }

    #[test]
    fn joints_are_found_within_what_drivers_add() {
        let ur = "shoulder_pan shoulder_lift elbow wrist_1 wrist_2 wrist_3";
        check(ur, ur, &[0, 1, 2, 3, 4, 5]);
        // The order of its ROS 2 driver, and of ROS 1's.
        check(
            ur,
            "shoulder_lift_joint elbow_joint wrist_1_joint wrist_2_joint wrist_3_joint shoulder_pan_joint",
            &[5, 0, 1, 2, 3, 4],
        );
        check(
            ur,
            "finger_joint left_elbow_joint left_shoulder_lift_joint left_shoulder_pan_joint left_wrist_1_joint left_wrist_2_joint left_wrist_3_joint",
            &[3, 2, 1, 4, 5, 6],
        );
        // A gripper's joints are called as some of the arm's.
        check(
            "joint1 joint2 joint3",
            "fr3_joint2 fr3_joint1 fr3_finger_joint1 fr3_finger_joint2 fr3_joint3",
            &[1, 0, 4],
        );
        // A rig from a URDF, a recording with bare names.
        check("arm_a_joint arm_b_joint", "b a", &[1, 0]);
        // What is there as it is is not looked for elsewhere.
        check("a b", "left_a left_b b a", &[3, 2]);
    }

    #[test]
    fn what_is_not_all_there_or_there_twice_is_told_apart() {
        let places = |rig: &str, recording: &str| super::places(&names(rig), &names(recording));
        assert_eq!(places("a b", "left_a right_b"), Places::Missing);
        assert_eq!(places("a b", "arm b a_2"), Places::Missing);
        // Not within words, nor with different words around.
        assert_eq!(places("a b", "xay xby"), Places::Missing);
        assert_eq!(places("joint1 joint2", "joint11 joint12"), Places::Missing);
        let both = places("a b", "left_a left_b right_b right_a");
        assert_eq!(both, Places::Several(vec!["left_a".to_owned(), "right_a".to_owned()]));
        assert_eq!(super::places(&[], &names("a")), Places::Missing);
    }
}
