//! Owns the presentation of `skinrig scene check`: event statistics of recordings side by side, as text and as a page.

mod figures;
mod page;
mod rows;

use skinrig_text::{Column, Table};

pub use self::page::page;
pub use self::rows::Recording;
use self::rows::{ROWS, cameras, remarks, source};

/// Recordings in a text of 100 columns.
const PER_TABLE: usize = 2;

/// One line per statistic, a column per camera, two recordings a table. At most 100 columns.
#[must_use]
pub fn terminal_text(recordings: &[Recording]) -> String {
    let all: Vec<_> = recordings.iter().enumerate().collect();
    let mut blocks = vec![
        all.iter()
            .copied()
            .map(source)
            .collect::<Vec<_>>()
            .join("\n"),
    ];
    for part in all.chunks(PER_TABLE) {
        let cameras = cameras(part.iter().copied());
        let mut columns = vec![Column::left(40)];
        columns.extend(cameras.iter().map(|_| Column::right(14)));
        let table = Table::new(columns);
        let heads = cameras.iter().map(|(name, _)| name.clone());
        let mut lines = vec![table.row(std::iter::once(String::new()).chain(heads))];
        lines.extend(ROWS.map(|(name, cell)| {
            let cells = cameras.iter().map(|(_, camera)| cell(camera));
            table.row(std::iter::once(name.to_owned()).chain(cells))
        }));
        blocks.push(lines.join("\n"));
    }
    blocks.extend(remarks(recordings));
    blocks.join("\n\n")
}

#[cfg(test)]
mod tests {
    use skinrig_analysis::event_statistics::{
        Bin, EventStatistics, IntervalLaw, PressPolarity, Ring,
    };
    use skinrig_model::CameraId;

    use super::*;
    use crate::format::NONE;

    #[test]
    fn every_statistic_has_a_line_and_a_missing_one_a_dash() {
        let law = IntervalLaw {
            n: 1_000,
            zero: 0,
            floor_us: Some(11),
            mean_us: 1_778.0,
            shape_us: 50.0,
            inverse_gaussian: 6.43,
            exponential: 8.48,
        };
        let camera = |camera, intervals| EventStatistics {
            camera,
            events: 2_000,
            duration_s: 4.0,
            on_share: Some(0.25),
            equal_times: Some(0.5),
            supported: Some(0.9),
            supported_by_chance: Some(0.1),
            correlation: [(0.0, 0.8), (4.0, 0.4), (8.0, 0.02)]
                .map(|(distance_px, active)| Ring {
                    distance_px,
                    active,
                })
                .to_vec(),
            correlation_by_chance: Some(0.01),
            dispersion: Some(3.0),
            active_pixels: 0.01,
            hottest_share: Some(0.03),
            pixels: vec![Bin {
                from: 1.0,
                to: 1.2,
                n: 7,
            }],
            intervals,
            interval_bins: vec![Bin {
                from: 1_000.0,
                to: 1_258.9,
                n: 900,
            }],
            polarity: Some(PressPolarity {
                presses: 3,
                at_press: 100,
                on_at_press: Some(0.8),
                at_lift: 0,
                on_at_lift: None,
            }),
            course: None,
        };
        let recordings = [
            Recording {
                name: "here.session.sqlite".to_owned(),
                origin: "simulated, optical".to_owned(),
                is_stand_in: true,
                without_presses: Some("no presses".to_owned()),
                broken_stream: None,
                cameras: vec![
                    camera(CameraId::One, Some(law)),
                    camera(CameraId::Two, None),
                ],
            },
            Recording {
                name: "<there>.raw".to_owned(),
                origin: "RAW file".to_owned(),
                is_stand_in: false,
                without_presses: None,
                broken_stream: Some("3 jumps of the time base".to_owned()),
                cameras: vec![camera(CameraId::One, None)],
            },
        ];
        let text = terminal_text(&recordings);
        assert!(text.lines().all(|l| l.chars().count() <= 100), "{text}");
        let line = |name: &str| text.lines().find(|l| l.starts_with(name)).unwrap();
        assert!(line("refractory floor").ends_with(NONE), "{text}");
        assert!(line("events per second").contains("500"), "{text}");
        assert!(
            line("law of the intervals").contains("inv. Gaussian"),
            "{text}"
        );
        assert!(line("events 8 px away").contains("2.0"), "{text}");
        assert!(line("events 28 px away").ends_with(NONE), "{text}");
        assert!(
            line("ON in the 200 ms from a contact").contains("80.0"),
            "{text}"
        );
        assert!(line("A: no contacts").ends_with("no presses"), "{text}");
        // Three recordings take two tables.
        let three = terminal_text(&[&recordings[..], &recordings[1..]].concat());
        let rows = three.lines().filter(|l| l.starts_with("events per second"));
        assert_eq!(rows.count(), 2, "{three}");

        let html = page(&recordings);
        for part in [
            "&lt;there&gt;.raw",
            "Simulated or emulated",
            "figure-intervals",
            "figure-distances",
            "figure-pixels",
        ] {
            assert!(html.contains(part), "{part}");
        }
        assert!(!html.contains("<there>"));
    }
}
