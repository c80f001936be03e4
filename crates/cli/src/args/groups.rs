//! The list of commands in the help, grouped by task.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, CommandFactory, FromArgMatches};

use skinrig_text::{LongWords, Paint, hang};

use super::Cli;
use super::repeated::given_twice;

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
