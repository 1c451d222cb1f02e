//! Lists of named tables: those of the file are matched by name, new ones follow.
use super::values::set;
use std::collections::BTreeMap;
use toml_edit::{Array, ArrayOfTables, InlineTable, Item, Table, TableLike, Value};

/// Brings a list to these names in this order.
///
/// `write` fills the table of an index; its flag says whether the file had that table before. Tables of names that are
/// gone are taken out. Returns true where the list itself is new.
pub(super) fn write_list(
    parent: &mut dyn TableLike,
    key: &str,
    names: &[&str],
    mut write: impl FnMut(&mut dyn TableLike, usize, bool),
) -> bool {
    if names.is_empty() {
        // An empty list that the author wrote stays as it is.
        if parent.get(key).is_some_and(|list| list.as_array().is_none_or(|array| !array.is_empty())) {
            parent.remove(key);
        }
        return false;
    }
    match parent.get_mut(key) {
        Some(Item::ArrayOfTables(tables)) => {
            write_tables(tables, names, &mut write);
            false
        }
        Some(Item::Value(Value::Array(array))) => {
            write_inline(array, names, &mut write);
            false
        }
        _ => {
            let mut tables = ArrayOfTables::new();
            write_tables(&mut tables, names, &mut write);
            parent.insert(key, Item::ArrayOfTables(tables));
            true
        }
    }
}

fn write_tables(tables: &mut ArrayOfTables, names: &[&str], write: &mut impl FnMut(&mut dyn TableLike, usize, bool)) {
    let in_order = is_in_order(tables.iter().map(|table| name_of(table)), names);
    let first_position = tables.iter().filter_map(Table::position).min();
    let mut old: BTreeMap<String, Table> =
        std::mem::take(tables).into_iter().map(|table| (name_of(&table).to_owned(), table)).collect();
    for (index, name) in names.iter().enumerate() {
        let known = old.remove(*name);
        let existed = known.is_some();
        let mut table = known.unwrap_or_default();
        write(&mut table, index, existed);
        if !in_order {
            // Tables are printed by position; without one, after the table before them.
            forget_positions(&mut table);
            if index == 0 {
                table.set_position(first_position);
            }
        }
        tables.push(table);
    }
}

fn write_inline(array: &mut Array, names: &[&str], write: &mut impl FnMut(&mut dyn TableLike, usize, bool)) {
    let mut old: BTreeMap<String, InlineTable> = BTreeMap::new();
    for value in array.iter() {
        if let Value::InlineTable(table) = value {
            old.insert(name_of(table).to_owned(), table.clone());
        }
    }
    array.clear();
    for (index, name) in names.iter().enumerate() {
        let known = old.remove(*name);
        let existed = known.is_some();
        let mut table = known.unwrap_or_default();
        write(&mut table, index, existed);
        array.push_formatted(Value::InlineTable(table));
    }
}

fn name_of(table: &dyn TableLike) -> &str {
    table.get("name").and_then(Item::as_str).unwrap_or_default()
}

/// True where the old names that are still there stand in the order of the new ones.
fn is_in_order<'a>(old: impl Iterator<Item = &'a str>, names: &[&str]) -> bool {
    let places: Vec<usize> = old.filter_map(|name| names.iter().position(|now| *now == name)).collect();
    places.is_sorted()
}

fn forget_positions(table: &mut Table) {
    table.set_position(None);
    for (_, item) in table.iter_mut() {
        match item {
            Item::Table(table) => forget_positions(table),
            Item::ArrayOfTables(tables) => tables.iter_mut().for_each(forget_positions),
            _ => {}
        }
    }
}

/// An array of strings, each on its own line where there are several.
pub(super) fn set_texts(table: &mut dyn TableLike, key: &str, texts: &[String]) {
    let mut array: Array = texts.iter().map(String::as_str).collect();
    if texts.len() > 1 {
        for value in array.iter_mut() {
            value.decor_mut().set_prefix("\n    ");
        }
        array.set_trailing("\n");
        array.set_trailing_comma(true);
    }
    set(table, key, Value::Array(array));
}
