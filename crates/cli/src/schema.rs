//! `skinrig schema`.

use crate::args::{SchemaArgs, SchemaKind};
use crate::exit::{Exit, Outcome};

/// Prints a JSON Schema.
///
/// # Errors
/// Never.
pub(crate) fn schema(args: &SchemaArgs) -> Outcome {
    let schema = match args.kind {
        SchemaKind::Protocol => skinrig_protocol::schema_json(),
        SchemaKind::Schedule => skinrig_protocol::schedule_schema_json(),
        SchemaKind::Rig => skinrig_protocol::rig_schema_json(),
        SchemaKind::Limits => skinrig_protocol::limits_schema_json(),
        SchemaKind::Selection => skinrig_protocol::selection_schema_json(),
        SchemaKind::Publication => skinrig_protocol::publication_schema_json(),
        SchemaKind::Settings => skinrig_protocol::new_settings_schema_json(),
        SchemaKind::Suite => skinrig_protocol::suite_schema_json(),
    };
    crate::terminal::out(format_args!("{schema}"));
    Ok(Exit::Ok)
}
