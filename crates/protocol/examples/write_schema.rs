//! Writes the JSON Schemas that ship beside the files: `cargo run -p skinrig-protocol --example write_schema`.

use skinrig_protocol::{
    limits_schema_json, rig_schema_json, schedule_schema_json, schema_json, selection_schema_json,
    suite_schema_json,
};

fn main() -> std::io::Result<()> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (path, schema) in [
        ("protocols/skinrig.schema.json", schema_json()),
        (
            "protocols/skinrig-schedule.schema.json",
            schedule_schema_json(),
        ),
        ("protocols/skinrig-limits.schema.json", limits_schema_json()),
        (
            "protocols/skinrig-selection.schema.json",
            selection_schema_json(),
        ),
        ("hil/rigs/skinrig-rig.schema.json", rig_schema_json()),
        ("hil/skinrig-suite.schema.json", suite_schema_json()),
    ] {
        std::fs::write(root.join(path), schema)?;
    }
    Ok(())
}
