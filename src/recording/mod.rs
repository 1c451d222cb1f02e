//! Recordings: what was commanded, read and seen; one file per format.
mod bag;
mod checked;
mod clock;
mod command;
mod describe;
mod groups;
mod images;
mod join;
mod jsonl;
mod names;
mod open;
mod order;
mod select;
mod table;
mod track;
mod types;

pub use bag::{BagOptions, Detect, Found};
pub(crate) use clock::{LATEST, are_far_apart, unit_of_date};
pub use command::Command;
pub(crate) use describe::px;
pub use images::{ImageSeen, Pairing, Rows};
pub use jsonl::Reader;
pub(crate) use names::natural_order;
pub use open::{Format, OpenOptions, Opened};
pub(crate) use order::is_in_another_order;
pub use table::{Actions, Angles, TableOptions};
pub use types::*;
