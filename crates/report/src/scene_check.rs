//! Owns the terminal text of `skinrig scene check`: event statistics of both cameras side by side.

use skinrig_analysis::event_statistics::{EventStatistics, IntervalLaw};
use skinrig_text::{Column, Table};

use crate::format::{NONE, number};

/// Value of one camera as text.
type Cell = fn(&EventStatistics) -> String;

fn percent(share: Option<f64>) -> String {
    number(share.map(|s| 100.0 * s), 1)
}

fn of_law(
    camera: &EventStatistics,
    value: impl Fn(&IntervalLaw) -> Option<f64>,
    digits: usize,
) -> String {
    number(camera.intervals.as_ref().and_then(value), digits)
}

const ROWS: [(&str, Cell); 12] = [
    ("events per second", |c| {
        number(
            (c.duration_s > 0.0).then(|| c.events as f64 / c.duration_s),
            0,
        )
    }),
    ("ON, %", |c| percent(c.on_share)),
    ("pixels with events, %", |c| percent(Some(c.active_pixels))),
    ("events of the busiest 1 % of pixels, %", |c| {
        percent(c.hottest_share)
    }),
    ("timestamp of the event before, %", |c| {
        percent(c.equal_times)
    }),
    ("near an event of the last ms, %", |c| percent(c.supported)),
    ("  by chance, %", |c| percent(c.supported_by_chance)),
    ("interval of a pixel, mean, ms", |c| {
        of_law(c, |law| Some(1e-3 * law.mean_us), 1)
    }),
    ("  refractory floor, us", |c| {
        of_law(c, |law| law.floor_us.map(f64::from), 0)
    }),
    ("  inverse Gaussian, nats per interval", |c| {
        of_law(c, |law| Some(law.inverse_gaussian), 2)
    }),
    ("  exponential", |c| {
        of_law(c, |law| Some(law.exponential), 2)
    }),
    ("  law", |c| match &c.intervals {
        None => NONE.to_owned(),
        Some(law) if law.inverse_gaussian < law.exponential => "inv. Gaussian".to_owned(),
        Some(_) => "exponential".to_owned(),
    }),
];

/// One line per statistic, a column per camera.
#[must_use]
pub fn terminal_text(cameras: &[EventStatistics]) -> String {
    let mut columns = vec![Column::left(40)];
    columns.extend(cameras.iter().map(|_| Column::right(14)));
    let table = Table::new(columns);
    let heads = cameras.iter().map(|c| c.camera.to_string());
    let mut text = table.row(std::iter::once(String::new()).chain(heads));
    for (name, cell) in ROWS {
        text.push('\n');
        text += &table.row(std::iter::once(name.to_owned()).chain(cameras.iter().map(cell)));
    }
    text
}

#[cfg(test)]
mod tests {
    use skinrig_model::CameraId;

    use super::*;

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
            active_pixels: 0.01,
            hottest_share: Some(0.03),
            intervals,
        };
        let text = terminal_text(&[
            camera(CameraId::One, Some(law)),
            camera(CameraId::Two, None),
        ]);
        assert_eq!(text.lines().count(), ROWS.len() + 1);
        let line = |name: &str| text.lines().find(|l| l.starts_with(name)).unwrap();
        assert!(line("  refractory floor").ends_with(NONE), "{text}");
        assert!(line("events per second").contains("500"), "{text}");
        assert!(line("  law").contains("inv. Gaussian"), "{text}");
    }
}
