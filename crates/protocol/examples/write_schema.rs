//! Writes the JSON Schemas that ship beside the protocols: `cargo run -p skinrig-protocol --example write_schema`.

fn main() -> std::io::Result<()> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../protocols");
    std::fs::write(
        folder.join("skinrig.schema.json"),
        skinrig_protocol::schema_json(),
    )?;
    std::fs::write(
        folder.join("skinrig-schedule.schema.json"),
        skinrig_protocol::schedule_schema_json(),
    )
}
