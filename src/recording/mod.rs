//! Recordings: what was commanded, read and seen; one file per format.
mod bag;
mod checked;
mod command;
mod images;
mod join;
mod jsonl;
mod names;
mod open;
mod select;
mod table;
mod track;
mod types;

pub use bag::{Bag, BagOptions, Detect};
pub use command::Command;
pub use images::{ImageSeen, Pairing};
pub use jsonl::Reader;
pub(crate) use names::natural_order;
pub use open::{Format, Opened};
pub use table::{Actions, Angles, Table, TableOptions};
pub use types::*;
