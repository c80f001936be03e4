//! The list of commands in the help, grouped by task.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgMatches, Command, CommandFactory, FromArgMatches};

use skinrig_text::{LongWords, Paint, hang};

use super::Cli;

/// Writes the styles of the help; clap removes them where no colours are wanted.
const HELP: Paint = Paint::new(true);

/// Heading and commands of each group, in the order of a campaign.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Plan", &["init", "new", "check", "plan", "schema"]),
    (
        "Record",
        &[
            "run", "resume", "import", "watch", "view", "status", "control", "note",
        ],
    ),
    (
        "Analyse",
        &[
            "analyze",
            "reanalyze",
            "report",
            "compare",
            "tradeoff",
            "online",
            "scene",
            "twin",
            "prototypes",
        ],
    ),
    (
        "Sessions",
        &[
            "sessions",
            "catalogue",
            "store",
            "show",
            "tag",
            "select",
            "verify",
            "salvage",
            "export",
            "lake",
            "publish",
            "reproduce",
            "challenge",
            "inspect",
        ],
    ),
    ("Bench", &["doctor", "devices", "jog", "hil"]),
    ("Shell", &["completions", "man"]),
];

/// Parses a command line; the help lists commands by group.
///
/// # Errors
/// Errors of clap, including the help that `--help` requests.
pub(crate) fn parse<I, T>(words: I) -> Result<Cli, clap::Error>
where
    I: IntoIterator<Item = T>,
    T: Into<std::ffi::OsString> + Clone,
{
    let mut command = command();
    let words: Vec<std::ffi::OsString> = words.into_iter().map(Into::into).collect();
    let parsed = command.try_get_matches_from_mut(&words);
    let matches = parsed.map_err(|error| match unread_negative(&error, &words) {
        Some(message) => command.error(ErrorKind::UnknownArgument, message),
        None => error,
    })?;
    if let Some(twice) = given_twice(&matches) {
        return Err(command.error(ErrorKind::ArgumentConflict, twice));
    }
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// Says how to give a negative value to an option, if one was read as an unknown option; `None` for any other error.
fn unread_negative(error: &clap::Error, words: &[std::ffi::OsString]) -> Option<String> {
    let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidArg) else {
        return None;
    };
    let is_number = |word: &str| {
        let mut rest = word.strip_prefix('-')?.chars();
        let first = rest.next()?;
        (first.is_ascii_digit() || first == '.').then_some(())
    };
    is_number(unknown)?;
    let mut words = words.windows(2).filter_map(|pair| {
        let (option, value) = (pair[0].to_str()?, pair[1].to_str()?);
        (value.starts_with(unknown) && option.starts_with("--")).then_some((option, value))
    });
    let (option, value) = words.next_back()?;
    Some(format!(
        "expected an option, found `{value}`\n\n  tip: a value that starts with `-` follows `=`: `{option}={value}`"
    ))
}

/// Options and arguments with values `KEY=VALUE`, and what precedes each on the command line.
const ASSIGNMENTS: [(&str, &str); 3] = [
    ("overrides", "--set "),
    ("margins", "--margin "),
    ("parameters", ""),
];

/// Says which key is given twice and differently, by `KEY=VALUE` or by an option of its own; `None` if none is.
fn given_twice(matches: &ArgMatches) -> Option<String> {
    let (_, matches) = matches.subcommand()?;
    given_twice(matches).or_else(|| {
        let mut all = ASSIGNMENTS.into_iter();
        all.find_map(|(id, prefix)| contradiction(matches, id, prefix))
    })
}

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

/// The command line with its grouped help.
pub(crate) fn command() -> Command {
    let command = Cli::command();
    let list = list(&command);
    command.help_template(format!(
        "{{before-help}}{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}\n{}\n{{options}}{{after-help}}",
        HELP.bold("Options:")
    ))
}

fn list(command: &Command) -> String {
    let widest = GROUPS.iter().flat_map(|(_, names)| *names);
    let width = widest.map(|name| name.len()).max().unwrap_or_default();
    let mut text = String::new();
    for (heading, names) in GROUPS {
        text += &format!("{}\n", HELP.bold(&format!("{heading}:")));
        for name in names {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            let name = HELP.bold(&format!("{name:width$}"));
            text += &hang(&format!("  {name}  "), &about, LongWords::Keep);
        }
        text += "\n";
    }
    text + "`skinrig COMMAND --help` has the options and examples of a command.\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_in_one_group() {
        let command = Cli::command();
        let visible = command.get_subcommands().filter(|c| !c.is_hide_set());
        let mut visible: Vec<&str> = visible.map(Command::get_name).collect();
        let mut listed: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        visible.sort_unstable();
        listed.sort_unstable();
        assert_eq!(listed, visible);
    }

    #[test]
    fn help_lists_commands_by_group() {
        let help = parse(["skinrig", "--help"]).unwrap_err().to_string();
        for (heading, _) in GROUPS {
            assert!(help.contains(&format!("{heading}:\n")), "{help}");
        }
        assert!(!help.contains("Commands:"), "{help}");
    }
}
