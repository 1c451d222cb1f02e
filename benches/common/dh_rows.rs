//! A joint from a row of a table in the peers' files.
use handeye::rig::{Joint, Limits};

/// `row`: offset [rad], d [m], a [m], alpha [rad].
pub fn joint(index: usize, row: &[f64], limits: Limits) -> Joint {
    let &[offset, d, a, alpha] = row else { panic!("a row has 4 numbers") };
    Joint {
        name: format!("j{index}"),
        offset: Some(offset),
        d: Some(d),
        a: Some(a),
        alpha: Some(alpha),
        limits,
        ..Joint::default()
    }
}
