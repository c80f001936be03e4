//! Owns the event-rate figures: whole session, and single presses in fine bins.

use std::fmt::Write as _;

use skinrig_analysis::result::{RateSeries, RateZoom};
use skinrig_model::PressId;

use super::canvas::{Canvas, Figure, LINKED, nice_above, press_path};
use crate::axes::{Axes, Scale};
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, polyline};

/// Unit for rates up to `most` events per second: divisor and name.
fn unit(most: f64) -> (f64, &'static str) {
    if most >= 1e6 {
        (1e6, "Mev/s")
    } else if most >= 1e3 {
        (1e3, "kev/s")
    } else {
        (1.0, "ev/s")
    }
}

fn highest<'a>(values: impl IntoIterator<Item = &'a f32>) -> f64 {
    values
        .into_iter()
        .map(|v| f64::from(*v))
        .filter(|v| v.is_finite())
        .fold(0.0, f64::max)
}

/// Step line through the bins. Runs of equal height become one stroke; a missing value breaks the line.
fn stairs(start: f64, width: f64, values: &[f32], axes: &Axes, divisor: f64) -> String {
    let mut d = String::new();
    let mut level: Option<String> = None;
    for (i, v) in values.iter().enumerate() {
        if !v.is_finite() {
            level = None;
            continue;
        }
        let left = axes.x.at(start + i as f64 * width);
        let right = axes.x.at(start + (i + 1) as f64 * width);
        let y = Px(axes.y.at(f64::from(*v) / divisor)).to_string();
        match &level {
            None => {
                let _ = write!(d, "M{} {y}", Px(left));
            }
            Some(l) if *l == y => {}
            Some(_) => {
                let _ = write!(d, "V{y}");
            }
        }
        let _ = write!(d, "H{}", Px(right));
        level = Some(y);
    }
    d
}

/// Event rate of both cameras over the session, with a mark at the contact of each press.
#[must_use]
pub fn event_rates(input: &ReportInput<'_>) -> Figure {
    // Without a clock fit the time axis is the camera's own, starting from 0, and the panel says so.
    let aligned = input.analysis.clocks.map(|c| c.is_some());
    let mut series = input.analysis.rates.clone();
    for (s, _) in series.iter_mut().zip(aligned).filter(|(_, a)| !a) {
        s.start_s = 0.0;
    }
    let presses = input.analysis.presses.iter();
    let (pressed, contacts): (Vec<PressId>, Vec<f64>) = presses
        .filter_map(|p| Some((p.press, p.timing?.contact.as_secs_f64())))
        .unzip();
    let ends = series
        .iter()
        .filter(|s| !s.mean_per_s.is_empty())
        .flat_map(|s| [s.start_s, s.start_s + s.bin_s * s.mean_per_s.len() as f64]);
    let low = ends.clone().fold(f64::INFINITY, f64::min);
    let high = ends.fold(f64::NEG_INFINITY, f64::max);
    let bin = |s: &RateSeries| {
        if s.bin_s >= 1.0 {
            format!("{} s", number(Some(s.bin_s), 2))
        } else {
            format!("{} ms", number(Some(s.bin_s * 1e3), 0))
        }
    };
    let caption = format!(
        "Event rates over the session (rows of the crop). A: camera 1, bins of {}; B: camera 2, bins of {}. Strong \
         line: mean per bin; light line: highest fine bin within it. Ticks between the panels: measured contacts ({}). \
         Zoom with the buttons or the keys + and -; pan by dragging or with the arrow keys.",
        bin(&series[0]),
        bin(&series[1]),
        contacts.len()
    );
    let size = (1240.0, 532.0);
    let plot = (66.0, 1224.0);
    let x = Scale::new((low, high), plot);
    let extra = [x.data.0, x.data.1].map(|v| format!("{v:.6}"));
    let mut canvas = Canvas::new(
        input,
        "event-rates",
        "Event rates",
        caption,
        size,
        &[
            ("data-t0", &extra[0]),
            ("data-t1", &extra[1]),
            ("data-x0", &plot.0),
            ("data-x1", &plot.1),
            LINKED,
        ],
    );
    let svg = &mut canvas.svg;
    svg.open("clipPath", &[("id", &"event-rates-clip")]);
    svg.leaf(
        "rect",
        &[
            ("x", &plot.0),
            ("y", &"0"),
            ("width", &(plot.1 - plot.0)),
            ("height", &"482"),
        ],
    );
    svg.close();
    for (camera, top) in [(0usize, 30.0), (1, 282.0)] {
        let s = &series[camera];
        let most = highest(s.peak_per_s.iter().chain(&s.mean_per_s));
        let (divisor, name) = unit(most);
        let axes = Axes {
            x,
            y: Scale::new((0.0, nice_above(most / divisor)), (top + 185.0, top)),
            x_label: if camera == 1 {
                "time since the session's start, host clock (s)".into()
            } else {
                String::new()
            },
            y_label: format!("event rate ({name})"),
            tick_count: (10, 4),
        };
        svg.open("g", &[("class", &"time-axes")]);
        axes.draw(svg);
        svg.close();
        let own = if aligned[camera] || s.mean_per_s.is_empty() {
            ""
        } else {
            " (clock not aligned: time since its first event)"
        };
        let panel = format!("{}   camera {}{own}", ["A", "B"][camera], camera + 1);
        svg.text((66.0, top - 9.0), "panel", "start", &panel);
        svg.open("g", &[("clip-path", &"url(#event-rates-clip)")]);
        svg.open("g", &[("class", &"zoomed")]);
        if camera == 0 {
            let marks: String = contacts
                .iter()
                .map(|t| format!("M{} 240v12", Px(x.at(*t))))
                .collect();
            press_path(svg, "marks", &marks, &pressed);
        }
        svg.path(
            &format!("line thin c{}", camera + 1),
            &stairs(s.start_s, s.bin_s, &s.peak_per_s, &axes, divisor),
        );
        svg.path(
            &format!("line c{}", camera + 1),
            &stairs(s.start_s, s.bin_s, &s.mean_per_s, &axes, divisor),
        );
        svg.close();
        svg.close();
        if s.mean_per_s.is_empty() {
            svg.text(
                (645.0, top + 98.0),
                "empty",
                "middle",
                "no events in this camera",
            );
        }
    }
    svg.text((60.0, 250.0), "tick", "end", "contacts");
    let n = format!(
        "{} and {} bins",
        series[0].mean_per_s.len(),
        series[1].mean_per_s.len()
    );
    canvas.finish(&n, "rates", "zoom")
}

/// ON and OFF rates around single presses, one column per press, one row per camera. `None` without any.
#[must_use]
pub(crate) fn press_rates(input: &ReportInput<'_>) -> Option<Figure> {
    let zooms = &input.analysis.zooms;
    let mut presses: Vec<PressId> = zooms.iter().map(|z| z.press).collect();
    presses.sort_unstable();
    presses.dedup();
    presses.truncate(6);
    if presses.is_empty() {
        return None;
    }
    let caption = "Event rates around single presses, ON and OFF events separately, against time since measured \
        contact. Dashed lines: contact and release. One column per press, camera 1 above, camera 2 below."
        .to_owned();
    let size = (1240.0, 480.0);
    let mut canvas = Canvas::new(
        input,
        "press-rates",
        "Single presses: event rates",
        caption,
        size,
        &[],
    );
    let column = (1240.0 - 66.0 - 14.0) / presses.len() as f64;
    for camera in 0..2 {
        let here = |press: PressId| {
            zooms
                .iter()
                .find(|z| z.press == press && z.camera.index() == camera)
        };
        let most = highest(
            presses
                .iter()
                .filter_map(|p| here(*p))
                .flat_map(|z| z.on_per_s.iter().chain(&z.off_per_s)),
        );
        let (divisor, name) = unit(most);
        let top = 40.0 + 205.0 * f64::from(camera as u8);
        for (i, press) in presses.iter().enumerate() {
            let left = 66.0 + column * i as f64;
            let Some(z) = here(*press) else { continue };
            let axes = Axes {
                x: Scale::new(span(z), (left, left + column - 16.0)),
                y: Scale::new((0.0, nice_above(most / divisor)), (top + 158.0, top)),
                x_label: if camera == 1 {
                    "time since contact (s)".into()
                } else {
                    String::new()
                },
                y_label: if i == 0 {
                    format!("camera {} ({name})", camera + 1)
                } else {
                    String::new()
                },
                tick_count: (6, if i == 0 { 4 } else { 0 }),
            };
            let svg = &mut canvas.svg;
            axes.draw(svg);
            if camera == 0 {
                svg.text((left, top - 20.0), "panel", "start", &press.to_string());
            }
            for t in [0.0, z.release_s] {
                if (z.start_s..=axes.x.data.1).contains(&t) {
                    svg.line("ref2", (axes.x.at(t), top), (axes.x.at(t), top + 158.0));
                }
            }
            svg.path(
                "line on-line",
                &stairs(z.start_s, z.bin_s, &z.on_per_s, &axes, divisor),
            );
            svg.path(
                "line off-line",
                &stairs(z.start_s, z.bin_s, &z.off_per_s, &axes, divisor),
            );
        }
    }
    let svg = &mut canvas.svg;
    for (i, (name, class)) in [("ON", "line on-line"), ("OFF", "line off-line")]
        .into_iter()
        .enumerate()
    {
        let x = 1120.0 + 58.0 * i as f64;
        svg.path(class, &polyline([(x, 14.0), (x + 18.0, 14.0)], false));
        svg.text((x + 23.0, 18.0), "tick", "start", name);
    }
    Some(canvas.finish(&format!("{} presses", presses.len()), "press_rates", ""))
}

fn span(z: &RateZoom) -> (f64, f64) {
    let bins = z.on_per_s.len().max(z.off_per_s.len());
    (z.start_s, z.start_s + z.bin_s * bins as f64)
}
