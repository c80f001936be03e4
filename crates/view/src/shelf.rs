//! Owns the answer with everything on the lab's shelf: sessions, prototypes, nights.

use serde_json::{Value, json};
use skinrig_recorder::writer_of;

use crate::folder::{Folder, name_of};
use crate::lab::{Lab, ShelfSession};
use crate::problem::Problem;

/// The sessions of the folder with their analyses, the prototypes and the nights.
pub(crate) fn document(lab: &dyn Lab, folder: &Folder) -> Result<Value, Problem> {
    let rows: Vec<Value> = lab.shelf(folder.path())?.iter().map(row).collect();
    // A part that cannot be read says so in its place; the others are shown.
    let part = |found: Result<Value, crate::lab::LabError>| match found {
        Ok(value) => value,
        Err(error) => json!({ "error": error.0 }),
    };
    Ok(json!({
        "folder": folder.path(),
        "sessions": rows,
        "prototypes": part(lab.prototypes(folder.path())),
        "nights": part(lab.nights(folder.path()).map(Value::from)),
    }))
}

fn row(
    ShelfSession {
        summary: session,
        analyses,
    }: &ShelfSession,
) -> Value {
    let mut row = json!({
        "name": name_of(&session.path),
        "size_bytes": session.size_bytes,
        "writer": writer_of(&session.path),
        "analyses": analyses,
    });
    let state = serde_json::to_value(&session.state);
    if let (Some(row), Ok(Value::Object(state))) = (row.as_object_mut(), state) {
        row.extend(state);
    }
    row
}
