//! What would do in place of a word that is not known.

/// "(did you mean `fx`?)" where a known word is near, else "(known: a, b, c)".
pub(crate) fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest(found, &known) {
        Some(word) => format!("(did you mean `{word}`?)"),
        None if known.is_empty() => "(there is none)".to_owned(),
        None => format!("(known: {})", known.join(", ")),
    }
}

/// "did you mean `ur3e`? " where a known name is near, and then all of them: for what is named on the command line.
pub(crate) fn shipped<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let meant = nearest(found, &known).map_or_else(String::new, |word| format!("did you mean `{word}`? "));
    format!("({meant}known: {})", known.join(", "))
}

/// The known word with the fewest edits, where a third of the letters or fewer have to change.
fn nearest<'a>(found: &str, known: &[&'a str]) -> Option<&'a str> {
    // Among equals one that was not written to its end.
    let key = |word: &&str| (edit_distance(found, word), !word.starts_with(found));
    let word = *known.iter().min_by_key(|word| key(word))?;
    let edits = edit_distance(found, word);
    let length = found.chars().count().max(word.chars().count());
    (edits * 3 <= length).then_some(word)
}

/// Letters to insert, delete, replace or swap with a neighbour (Damerau's distance, each place edited once).
fn edit_distance(from: &str, to: &str) -> usize {
    let from: Vec<char> = from.to_lowercase().chars().collect();
    let to: Vec<char> = to.to_lowercase().chars().collect();
    let mut before_last = vec![0; to.len() + 1];
    let mut last: Vec<usize> = (0..=to.len()).collect();
    for i in 0..from.len() {
        let mut row = vec![i + 1];
        for j in 0..to.len() {
            let replaced = last[j] + usize::from(from[i] != to[j]);
            let mut best = replaced.min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && from[i] == to[j - 1] && from[i - 1] == to[j] {
                best = best.min(before_last[j - 1] + 1);
            }
            row.push(best);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_finger_finds_its_word_and_another_word_gets_the_list() {
        let known = ["offset", "d", "a", "alpha", "beta"];
        for (found, word) in [("ofset", "offset"), ("alhpa", "alpha"), ("Beta", "beta"), ("alphas", "alpha")] {
            assert_eq!(suggestion(found, known), format!("(did you mean `{word}`?)"));
        }
        for found in ["theta_max", "q", "length"] {
            assert_eq!(suggestion(found, known), "(known: offset, d, a, alpha, beta)");
        }
    }

    #[test]
    fn distances_are_those_counted_by_hand() {
        for (from, to, edits) in [("", "", 0), ("", "abc", 3), ("kitten", "sitting", 3), ("fx", "xf", 1), ("é", "e", 1)]
        {
            assert_eq!(edit_distance(from, to), edits, "{from} {to}");
            assert_eq!(edit_distance(to, from), edits, "{to} {from}");
        }
    }
}
