//! Recordings: what was commanded, read and seen; one file per format.
mod bag;
mod command;
mod join;
mod jsonl;
mod names;
mod select;
mod types;

pub use bag::{Bag, BagOptions};
pub use command::Command;
pub use jsonl::Reader;
pub(crate) use names::natural_order;
pub use types::*;
