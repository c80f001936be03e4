//! Environment variables in the texts of a rig file: `${NAME}`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use skinrig_settings::{Collector, Field};

/// The value of an environment variable.
pub type Environment<'a> = &'a dyn Fn(&str) -> Option<String>;

/// The variables that a text mentions, with their values. A variable with an empty value counts as not set.
pub(super) fn mentioned(text: &str, environment: Environment<'_>) -> BTreeMap<String, String> {
    let names = text.split("${").skip(1);
    let names = names.filter_map(|rest| rest.split_once('}').map(|(name, _)| name));
    names
        .filter_map(|name| Some((name.to_owned(), environment(name)?)))
        .filter(|(_, value)| !value.is_empty())
        .collect()
}

/// A text with every `${NAME}` replaced by its value.
pub(super) fn text(f: &Field, out: &mut Collector) -> Option<String> {
    let text = f.as_text()?;
    let mut done = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("${") {
        done.push_str(before);
        let Some((name, after)) = after.split_once('}') else {
            out.error(f.span, f.path.as_str(), "the variable is not closed")
                .expected("`${NAME}`")
                .found(format!("`{text}`"));
            return None;
        };
        let Some(value) = out.variables.get(name) else {
            let message = "the environment variable is not set";
            out.error(f.span, f.path.as_str(), message)
                .expected(format!("a value of `{name}`"))
                .found("none")
                .help(format!("export {name}=..., or write the path out"));
            return None;
        };
        done.push_str(value);
        rest = after;
    }
    done.push_str(rest);
    Some(done)
}

/// A text as a path.
pub(super) fn path(f: &Field, out: &mut Collector) -> Option<PathBuf> {
    text(f, out).map(PathBuf::from)
}

/// A list of texts.
pub(super) fn texts(f: &Field, out: &mut Collector) -> Option<Vec<String>> {
    f.items().iter().map(|item| text(item, out)).collect()
}
