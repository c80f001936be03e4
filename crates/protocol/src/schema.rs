//! JSON Schemas of the five languages.

use skinrig_settings::{Settings, schema_json as schema};

/// The JSON Schema of a protocol, for editors: documentation, completion, checks while typing.
#[must_use]
pub fn schema_json() -> String {
    schema(crate::keys::ProtocolKeys::TABLE, "skinrig protocol")
}

/// The JSON Schema of a schedule for `skinrig import`.
#[must_use]
pub fn schedule_schema_json() -> String {
    schema(crate::keys::ScheduleKeys::TABLE, "skinrig schedule")
}

/// The JSON Schema of a rig file for `--rig`.
#[must_use]
pub fn rig_schema_json() -> String {
    schema(&crate::rig::keys::RIG, "skinrig rig")
}

/// The JSON Schema of the limits for `skinrig compare`.
#[must_use]
pub fn limits_schema_json() -> String {
    schema(&crate::limits::LIMITS, "skinrig limits")
}

/// The JSON Schema of a suite for `skinrig hil run`.
#[must_use]
pub fn suite_schema_json() -> String {
    schema(&crate::suite::keys::SUITE, "skinrig suite")
}
