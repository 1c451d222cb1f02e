//! What has to be said where the lengths of a rig are no metres.
use crate::rig::Rig;

/// How the line of `[fit]`'s `gauge` begins where nothing metric was known while the rig was learned.
const NO_METRES: &str = "lengths are in units of ";

/// The note on a rig whose lengths are in a unit of its own, and what would do; `None` where they are metres.
pub fn note_on_unit(rig: &Rig) -> Option<String> {
    let unit = rig.fit.as_ref()?.gauge.iter().find(|line| line.starts_with(NO_METRES))?;
    Some(format!(
        "these are not metres: {unit}. One known length (of a link, between two features, of a camera's place) in the rig that calibrate \
         starts from (--rig) would do"
    ))
}

/// The note as comment lines that begin with `#`; empty where lengths are metres.
pub(super) fn comment(rig: &Rig) -> String {
    note_on_unit(rig).map_or_else(String::new, |note| format!("# {note}\n"))
}
