//! What joints, cameras, features and targets may be called.

/// Why a name is refused, and what would do; `None` where it is fine.
///
/// A name is a component of parameter paths (`cameras.left.fx`), in which `.` separates and `*` stands for any.
pub(crate) fn problem_of_name(name: &str) -> Option<String> {
    if name.is_empty() {
        return Some("a name is empty".to_owned());
    }
    let wrong = name.chars().find(|&c| c == '.' || c == '*' || c.is_control())?;
    Some(format!(
        "the name {name:?} has a {wrong:?}, which parameter paths cannot hold: anything but `.`, `*` and line breaks would do"
    ))
}

/// The same for a joint, whose name also says what a camera or feature is fixed to.
pub(crate) fn problem_of_joint_name(name: &str) -> Option<String> {
    if name == "world" || name == "tip" {
        return Some(format!("a joint cannot be called `{name}`, which is the parent of that name"));
    }
    problem_of_name(name)
}
