//! What is said where the lengths of a rig are no metres.
use crate::rig::Rig;

/// The unit of a rig's lengths and what would do; `None` where they are metres.
pub fn note_on_unit(rig: &Rig) -> Option<String> {
    let unit = rig.fit.as_ref()?.unit()?;
    Some(format!("these are not metres: {unit}; one known length in the --rig of calibrate would make them metres"))
}

/// The note as comment lines that begin with `#`; empty where lengths are metres.
pub(super) fn comment(rig: &Rig) -> String {
    note_on_unit(rig).map_or_else(String::new, |note| format!("# {note}\n"))
}
