//! What was commanded in rows, for the samples that are made of them.
use super::images::Pairing;
use super::{Recording, Sample};
use std::collections::BTreeSet;

/// Takes what is commanded in each sample's row where the next sample is of the next row, to which it leads, and says of the rest why it is lost.
///
/// `rows`: of each sample, where there is one whose command could be its.
pub(super) fn take_actions(
    samples: &mut [Sample],
    rows: &[Option<usize>],
    states: &Recording,
    pairing: Pairing,
    notes: &mut Vec<String>,
) {
    let mut kept = BTreeSet::new();
    for (index, sample) in samples.iter_mut().enumerate() {
        let leads = |row: &usize| rows.get(index + 1) == Some(&Some(row + 1));
        let row = rows[index].filter(leads);
        let of_row = row.map(|row| &states.samples[row]);
        sample.joint_action = of_row.and_then(|row| row.joint_action.clone());
        sample.pose_action = of_row.and_then(|row| row.pose_action);
        kept.extend(row);
    }
    let seen: BTreeSet<usize> = rows.iter().flatten().copied().collect();
    let is_commanded = |row: &usize| {
        let Sample { joint_action, pose_action, .. } = &states.samples[*row];
        joint_action.is_some() || pose_action.is_some()
    };
    let commanded: Vec<usize> = (0..states.samples.len()).filter(is_commanded).collect();
    let has_image = match pairing {
        Pairing::Time => "no image that shows anything was taken at the time of",
        Pairing::Order | Pairing::Name => "no image that shows anything is of",
    };
    let (mut of_none, mut to_none, mut to_other) = (0, 0, 0);
    for row in commanded.iter().filter(|row| !kept.contains(row)) {
        match (seen.contains(row), seen.contains(&(row + 1))) {
            (false, _) => of_none += 1,
            (true, false) => to_none += 1,
            (true, true) => to_other += 1,
        }
    }
    let all = commanded.len();
    for (lost, why) in [
        (of_none, format!("{has_image} their row")),
        (to_none, format!("{has_image} the row that they lead to")),
        (to_other, "the row that they lead to is not that of the next image".to_owned()),
    ] {
        if lost > 0 {
            notes.push(format!("{lost} of {all} commanded motions are left out: {why}"));
        }
    }
}
