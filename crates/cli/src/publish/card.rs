//! The data card of a crate: what the data are, how they were recorded, and their known limits.

use std::collections::BTreeSet;

use skinrig_analysis::Analysis;
use skinrig_protocol::{Publication, Selection};
use skinrig_report::{Provenance, derive};

use super::headline::{Headline, Number};

/// A published session.
pub(super) struct Published {
    /// Folder of its bundle.
    pub bundle: String,
    pub provenance: Provenance,
    /// The protocol as it was run.
    pub protocol_text: String,
    /// With the selection, if there is one.
    pub analysis: Analysis,
}

/// The card as Markdown.
pub(super) fn card(
    about: &Publication,
    sessions: &[Published],
    headline: &Headline,
    selection: Option<&Selection>,
) -> String {
    let mut out = format!(
        "# {}\n\n{}\n\n",
        plain(&about.title),
        plain(&about.description)
    );
    let people = about
        .people
        .iter()
        .map(|p| format!("{} ({})", plain(&p.name), p.id()));
    out += &format!("- people: {}\n", people.collect::<Vec<_>>().join("; "));
    if let Some(publisher) = &about.publisher {
        out += &format!(
            "- publisher: {} ({})\n",
            plain(&publisher.name),
            publisher.url
        );
    }
    out += &format!(
        "- licence: {} (https://spdx.org/licenses/{})\n- published: {}\n- made with: {}\n",
        about.license, about.license, about.published_on, headline.software
    );
    out += &selected(selection);
    out += &numbers(headline);
    out += "## Sessions\n\n";
    for session in sessions {
        out += &described(session);
    }
    out += &limits(about, sessions);
    out + FILES
}

const FILES: &str = "## Files\n\n\
    - `ro-crate-metadata.json`: every file with size and SHA-256\n\
    - `NAME.bundle/`: the sealed session (SQLite), and everything that follows from it: results, report, camera streams (Prophesee \
    RAW), tables (Parquet, CSV)\n\
    - `NAME.protocol.yaml`: the protocol as it was run\n\
    - `headline.json`: the numbers above with all their digits\n\
    - `selected/`: results and tables with the selection, if there is one\n\n\
    `skinrig reproduce FOLDER` (`reproduce.sh`) compares every file with its checksum and derives every number again from the sessions.\n";

/// Excluded presses, with person and reason.
fn selected(selection: Option<&Selection>) -> String {
    let Some(selection) = selection else {
        return String::new();
    };
    let mut out = format!(
        "\n## Selection\n\nThe numbers are those of the selection {} (SHA-256 {}).\n\n",
        plain(&selection.name),
        selection.sha256
    );
    let mut none = true;
    for session in &selection.sessions {
        let only = session.only.iter().map(|choice| ("all but ", choice));
        for (word, choice) in only.chain(session.exclude.iter().map(|choice| ("", choice))) {
            none = false;
            out += &format!(
                "- {}: {word}presses {} excluded: {} (decided by {})\n",
                plain(&session.file),
                skinrig_settings::Setting::text(&choice.presses),
                plain(&choice.reason),
                plain(&choice.decided_by)
            );
        }
    }
    if none {
        out += "It excludes no press.\n";
    }
    out
}

fn numbers(headline: &Headline) -> String {
    let mut out =
        "\n## Numbers\n\n| session | number | value | 95 % interval | n |\n|---|---|---|---|---|\n"
            .to_owned();
    let shown = |n: &&Number| n.metric == "rmse" || n.metric == "located_rate";
    for session in &headline.sessions {
        for number in session.numbers.iter().filter(shown) {
            let value = |v: Option<f64>| v.map_or_else(|| "none".to_owned(), |v| format!("{v:.3}"));
            let unit = if number.unit == "1" { "" } else { &number.unit };
            out += &format!(
                "| {} | {} | {} {unit} | {} to {} | {} |\n",
                plain(&session.bundle),
                number.name(),
                value(number.value),
                value(number.low),
                value(number.high),
                number.n
            );
        }
    }
    out + "\n"
}

/// Origin of a session.
fn described(session: &Published) -> String {
    let (p, c) = (&session.provenance, &session.analysis.counts);
    let kind = match (p.simulated, p.emulated) {
        (true, _) => "SIMULATED, not measured on hardware",
        (_, true) => "EMULATED, not measured on hardware",
        _ => &p.rig_kind,
    };
    let mut out = format!(
        "### {}\n\n- prototype: {}\n- started: {}\n- rig: {} ({kind})\n- protocol: {} (SHA-256 {}), seed {}\n- run: {}\n\
         - presses: {} planned = {} valid + {} missed + {} invalid + {} excluded; {} sync presses\n",
        plain(&session.bundle),
        plain(&p.prototype),
        plain(&p.started),
        plain(&p.rig_name),
        plain(&p.protocol_name),
        p.protocol_sha256,
        p.seed,
        plain(&p.run_end),
        c.planned,
        c.valid,
        c.missed,
        c.invalid,
        c.excluded,
        c.sync
    );
    if !p.overrides.is_empty() {
        out += &format!(
            "- recorded with: --set {}\n",
            plain(&p.overrides.join(" --set "))
        );
    }
    out += &format!(
        "- analysis: version {}, results {}\n",
        session.analysis.version, p.results_hash
    );
    for device in &p.devices {
        out += &format!(
            "- {}: {}, serial {}, firmware {}\n",
            plain(&device.role),
            plain(&device.model),
            plain(&device.serial),
            plain(&device.firmware)
        );
    }
    out + "\n"
}

/// Limits that the authors state, and those that the sessions show.
fn limits(about: &Publication, sessions: &[Published]) -> String {
    let mut out = "## Known limits\n\n".to_owned();
    for limit in &about.known_limits {
        out += &format!("- {}\n", plain(limit));
    }
    for session in sessions {
        let (a, p) = (&session.analysis, &session.provenance);
        let mut found = BTreeSet::new();
        found.extend(a.remarks().map(ToString::to_string));
        found.extend(a.findings.iter().map(|f| f.evidence.to_string()));
        found.extend(derive::geometry_note(a));
        found.extend(derive::off_sensor(a));
        let lost = p.lost_bytes.iter().sum::<u64>();
        if lost > 0 {
            found.insert(format!("{lost} bytes of camera data were lost"));
        }
        out.extend(
            found
                .iter()
                .map(|text| format!("- {}: {}\n", plain(&session.bundle), plain(text))),
        );
    }
    out + "\n"
}

/// Text without characters that act in Markdown or HTML, in one line.
fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '&' => out.push_str("&amp;"),
            '|' | '*' | '_' | '`' | '[' | ']' | '\\' | '#' => out.extend(['\\', c]),
            c if c.is_control() || ('\u{200e}'..='\u{202e}').contains(&c) => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
