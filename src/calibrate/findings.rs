//! Findings as lines to read: many of one kind are one line, with the samples as runs.
use super::Finding;
use super::report::Distance;

/// So many of a kind are told one by one.
const FEW: usize = 3;

/// Runs of samples that are named.
const RUNS: usize = 12;

/// Lines for all of them, in order. `is_learned`: true where what does not fit was left out, false where a rig is judged.
pub fn findings_in_words(findings: &[Finding], is_learned: bool) -> Vec<String> {
    let mut lines = Vec::new();
    for (index, finding) in findings.iter().enumerate() {
        let kind = kind(finding);
        let same = |other: &&Finding| kind.is_some() && self::kind(other) == kind;
        let all: Vec<&Finding> = findings.iter().filter(same).collect();
        if all.len() <= FEW {
            lines.push(if is_learned { finding.to_string() } else { finding.of_evaluation() });
        } else if findings.iter().position(|other| self::kind(other) == kind) == Some(index) {
            lines.push(together(&all, is_learned));
        }
    }
    lines
}

/// What is told together; `None` for what stands alone.
fn kind(finding: &Finding) -> Option<(usize, &str)> {
    match finding {
        Finding::WrongJoints { swapped_with: None, by_pose, .. } => Some((usize::from(*by_pose), "")),
        Finding::UnknownState { .. } => Some((2, "")),
        Finding::WrongImage { camera, off: Distance::Pixels(_), .. } => Some((3, camera)),
        Finding::WrongImage { camera, off: Distance::Metres(_), .. } => Some((4, camera)),
        Finding::MissedLength { length, .. } => Some((5, length.between.parts().0)),
        _ => None,
    }
}

/// Several of one kind.
fn together(all: &[&Finding], is_learned: bool) -> String {
    let missed = |finding: &Finding| match finding {
        Finding::MissedLength { length, learned } => (learned - length.length).abs() / length.sd,
        _ => 0.0,
    };
    let worst = all.iter().max_by(|one, other| missed(one).total_cmp(&missed(other)));
    if let Some(worst @ Finding::MissedLength { length, .. }) = worst {
        let (count, what) = (all.len(), length.between.parts().0);
        return format!("{count} measured distances between {what} are not met; the worst: {worst}");
    }
    let samples = runs(all.iter().filter_map(|finding| sample_of(finding)).collect());
    let what = match all.first() {
        Some(Finding::WrongJoints { by_pose: true, .. }) => {
            "their tip poses do not lead to what the cameras saw".to_owned()
        }
        Some(Finding::WrongImage { camera, .. }) => format!("the images of camera `{camera}` belong to other poses"),
        Some(Finding::UnknownState { .. }) => {
            "nothing was read of the robot's state, and the images do not determine it".to_owned()
        }
        _ => "their joints do not lead to what the cameras saw".to_owned(),
    };
    let left_out = if is_learned { "; they were left out" } else { "" };
    format!("{} samples ({samples}): {what}{}{left_out}", all.len(), range(all))
}

fn sample_of(finding: &Finding) -> Option<usize> {
    match finding {
        Finding::WrongJoints { sample, .. } | Finding::UnknownState { sample } | Finding::WrongImage { sample, .. } => {
            Some(*sample)
        }
        _ => None,
    }
}

/// From the least to the largest distance; nothing where there are none.
fn range(all: &[&Finding]) -> String {
    let off = |finding: &&Finding| match finding {
        Finding::WrongJoints { off, .. } | Finding::WrongImage { off, .. } => Some(*off),
        _ => None,
    };
    let mut offs: Vec<Distance> = all.iter().filter_map(off).collect();
    offs.sort_by(|one, other| one.size().total_cmp(&other.size()));
    let ends = offs.first().zip(offs.last());
    ends.map_or_else(String::new, |(least, most)| format!(" ({least:.1} to {most:.1})"))
}

/// "3, 7 to 12 and 20", of samples counted from 0.
fn runs(mut samples: Vec<usize>) -> String {
    samples.sort_unstable();
    samples.dedup();
    let runs: Vec<&[usize]> = samples.chunk_by(|one, next| one + 1 == *next).collect();
    let word = |run: &&[usize]| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first} to {last}"),
        [] => String::new(),
    };
    let mut words: Vec<String> = runs.iter().take(RUNS).map(word).collect();
    let more: usize = runs.iter().skip(RUNS).map(|run| run.len()).sum();
    words.extend((more > 0).then(|| format!("{more} more")));
    let last = words.pop().unwrap_or_default();
    if words.is_empty() { last } else { format!("{} and {last}", words.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_named_as_runs_and_no_more_than_can_be_read() {
        assert_eq!(runs(vec![9, 3, 7, 8]), "3 and 7 to 9");
        assert_eq!(runs((5..300).collect()), "5 to 299");
        assert!(runs((0..100).map(|index| 2 * index).collect()).ends_with("22 and 88 more"));
    }
}
