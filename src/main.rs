//! The command `handeye`.
fn main() {}
