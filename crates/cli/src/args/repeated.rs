//! Refuses a key that is given twice with different values, since only the last one would count.

use clap::ArgMatches;

/// Options and arguments with values `KEY=VALUE`, and what precedes each on the command line.
const ASSIGNMENTS: [(&str, &str); 3] = [
    ("overrides", "--set "),
    ("margins", "--margin "),
    ("parameters", ""),
];

/// Says which key is given twice and differently, by `KEY=VALUE` or by an option of its own; `None` if none is.
pub(super) fn given_twice(matches: &ArgMatches) -> Option<String> {
    let (_, matches) = matches.subcommand()?;
    given_twice(matches).or_else(|| {
        let mut all = ASSIGNMENTS.into_iter();
        all.find_map(|(id, prefix)| contradiction(matches, id, prefix))
    })
}

/// The first contradiction among the values of one option or argument.
fn contradiction(matches: &ArgMatches, id: &str, prefix: &str) -> Option<String> {
    let raw = |id: &str| -> Vec<String> {
        let given = matches.try_get_raw(id).ok().flatten();
        let texts = given.into_iter().flatten();
        texts.map(|t| t.to_string_lossy().into_owned()).collect()
    };
    // Key, value, and how they were given.
    let mut given: Vec<(String, String, String)> = Vec::new();
    if id == "overrides" {
        for (key, option) in [("seed", "seed"), ("scene.level", "level")] {
            let values = raw(option).into_iter().take(1);
            given.extend(values.map(|v| (key.to_owned(), v.clone(), format!("--{option} {v}"))));
        }
    }
    for text in raw(id) {
        let Some((key, value)) = text.split_once('=') else {
            continue;
        };
        let by = format!("{prefix}{text}");
        for (earlier, earlier_value, earlier_by) in &given {
            if earlier == key && earlier_value != value {
                return Some(format!(
                    "expected one value of `{key}`, found `{earlier_by}` and `{by}`"
                ));
            }
            let is_part = |whole: &str, part: &str| {
                part.strip_prefix(whole)
                    .is_some_and(|rest| rest.starts_with('.'))
            };
            if is_part(earlier, key) || is_part(key, earlier) {
                return Some(format!(
                    "expected a map or single keys of it, found `{earlier_by}` and `{by}`\n\n  tip: set each key on its own, or all in the map"
                ));
            }
        }
        given.push((key.to_owned(), value.to_owned(), by));
    }
    None
}
