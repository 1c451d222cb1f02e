//! Single values of a TOML document: numbers, arrays, poses, put where they differ from what stands there.
use crate::geometry::orientation;
use handeye_solvers::Pose;
use toml_edit::{Array, InlineTable, Item, TableLike, Value};

/// A float in its shortest form that reads back as the same number.
pub(super) fn number(value: f64) -> Value {
    // 1e-7 rather than 0.0000001; what does not parse (it all does) falls back to the plain form.
    format!("{value:?}").parse().unwrap_or_else(|_| Value::from(value))
}

pub(super) fn numbers(values: &[f64]) -> Value {
    Value::Array(values.iter().map(|value| number(*value)).collect::<Array>())
}

pub(super) fn pose(pose: &Pose) -> Value {
    let mut table = InlineTable::new();
    table.insert("xyz", numbers(pose.translation.as_slice()));
    table.insert("quat", numbers(&orientation::to_quaternion(&pose.rotation)));
    Value::InlineTable(table)
}

/// A table that is being written, and what its file said before.
pub(super) struct Writer<'a> {
    pub(super) table: &'a mut dyn TableLike,
    /// True where nothing stands there yet, so that everything is written.
    pub(super) fresh: bool,
}

impl Writer<'_> {
    /// Writes what differs from `before`; what became `None` is taken out.
    pub(super) fn put<T: PartialEq>(
        &mut self,
        key: &str,
        before: &Option<T>,
        now: &Option<T>,
        value: impl FnOnce(&T) -> Value,
    ) {
        match now {
            Some(now) if self.fresh || before.as_ref() != Some(now) => set(self.table, key, value(now)),
            None if !self.fresh && before.is_some() => {
                self.table.remove(key);
            }
            _ => {}
        }
    }

    /// The same for a value that has a default in place of `None`, which is not written to where nothing stood.
    pub(super) fn put_default<T: PartialEq>(&mut self, key: &str, before: T, now: T, value: impl FnOnce(&T) -> Value) {
        if self.fresh || before != now {
            set(self.table, key, value(&now));
        }
    }

    /// The same for a pose. A table that stands there is kept, with its comments; a rotation becomes a quaternion.
    pub(super) fn put_pose(&mut self, key: &str, before: &Option<Pose>, now: &Option<Pose>) {
        if let (Some(before), Some(now), false) = (before, now, self.fresh)
            && let Some(item) = self.table.get_mut(key)
            && (before.rotation == now.rotation || !item.is_value())
            && let Some(table) = item.as_table_like_mut()
        {
            if before.translation != now.translation {
                set(table, "xyz", numbers(now.translation.as_slice()));
            }
            if before.rotation != now.rotation {
                table.remove("rpy");
                set(table, "quat", numbers(&orientation::to_quaternion(&now.rotation)));
            }
            return;
        }
        self.put(key, before, now, pose);
    }
}

/// Puts a value in a table; what stood there leaves its comments.
pub(super) fn set(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key) {
        Some(Item::Value(old)) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        _ => {
            table.insert(key, Item::Value(value));
        }
    }
}
