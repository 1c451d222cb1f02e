//! The shipped rigs, inside the program, so that commands work without the files.
use super::Rig;
use crate::Error;
use crate::error::suggestion;

/// Name and rig file of every shipped rig, the demonstration rig first.
pub const ALL: &[(&str, &str)] = &[
    ("ur5", include_str!("../../models/ur5.toml")),
    ("ur5_arm", include_str!("../../models/ur5_arm.toml")),
    ("ur5e", include_str!("../../models/ur5e.toml")),
    ("ur3e", include_str!("../../models/ur3e.toml")),
    ("ur10", include_str!("../../models/ur10.toml")),
    ("ur10e", include_str!("../../models/ur10e.toml")),
    ("puma560", include_str!("../../models/puma560.toml")),
    ("wam4", include_str!("../../models/wam4.toml")),
    ("wam7", include_str!("../../models/wam7.toml")),
    ("panda", include_str!("../../models/panda.toml")),
    ("iiwa14", include_str!("../../models/iiwa14.toml")),
    ("jaco", include_str!("../../models/jaco.toml")),
    ("baxter_left", include_str!("../../models/baxter_left.toml")),
    ("scara", include_str!("../../models/scara.toml")),
];

/// The shipped rig of that name.
///
/// Errors: [`Error::Unusable`] with the known names where there is none.
pub fn rig(name: &str) -> Result<Rig, Error> {
    let Some((_, text)) = ALL.iter().find(|(known, _)| *known == name) else {
        let known = suggestion(name, ALL.iter().map(|(known, _)| *known));
        return Err(Error::Unusable(format!("no shipped rig is called `{name}` {known}")));
    };
    Rig::parse(text, &format!("models/{name}.toml"))
}
