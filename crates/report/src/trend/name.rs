//! Owns the names of series for people; the identifiers are for commands and files.

use skinrig_nightly::trend::Report;

use crate::format::phrase;

/// Name of a series: `trigger_loopback/camera1/jitter` is "camera 1: jitter (trigger loopback)".
pub(crate) fn series_name(identifier: &str) -> String {
    let parts: Vec<&str> = identifier.split('/').collect();
    match parts[..] {
        ["derived", subject, metric] => {
            let ratio = match metric.split_once("_over_") {
                Some((over, under)) => {
                    format!("{}, relative to {}", phrase(over), phrase(under))
                }
                None => format!("{}, camera 1 relative to camera 2", phrase(metric)),
            };
            format!("{}: {ratio}", phrase(subject))
        }
        [check, subject, metric] => {
            format!(
                "{}: {} ({})",
                phrase(subject),
                phrase(metric),
                phrase(check)
            )
        }
        _ => phrase(&identifier.replace('/', ", ")),
    }
}

/// `text` with names instead of the identifiers of the series of `report`.
pub(crate) fn with_names(text: &str, report: &Report) -> String {
    let mut names: Vec<&str> = report.charts.iter().map(|c| &*c.series.name).collect();
    // An identifier may begin with another one.
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    names.into_iter().fold(text.to_owned(), |text, name| {
        text.replace(name, &series_name(name))
    })
}

#[cfg(test)]
mod tests {
    use skinrig_nightly::trend::derived::RATIOS;

    use super::*;

    #[test]
    fn names_are_phrases() {
        for (identifier, name) in [
            (
                "trigger_loopback/camera1/jitter",
                "camera 1: jitter (trigger loopback)",
            ),
            ("golden/skin/rmse", "skin: RMSE (golden)"),
            (
                "derived/skin/rmse_over_reference_shift",
                "skin: RMSE, relative to reference shift",
            ),
            (
                "derived/cameras/noise_dark",
                "cameras: noise dark, camera 1 relative to camera 2",
            ),
            ("a_b", "a b"),
        ] {
            assert_eq!(series_name(identifier), name);
        }
        for ratio in RATIOS {
            assert!(
                !series_name(ratio.name).contains(['/', '_']),
                "{}",
                ratio.name
            );
        }
    }
}
