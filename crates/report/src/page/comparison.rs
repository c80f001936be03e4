//! Owns the tables that compare the session with published skins, and with the public code's evaluation.

use skinrig_analysis::result::{Analysis, Thinning};
use skinrig_model::Estimator;

use crate::comparison::{Cell, rows};
use crate::document::Table;
use crate::format::{self, NONE, interval, number};
use crate::input::ReportInput;
use crate::published::{self, Metric};

fn digits(metric: Metric, value: Option<f64>) -> usize {
    match metric {
        Metric::PressRate | Metric::IdleRate | Metric::Samples
            if value.is_some_and(|v| v >= 10.0) =>
        {
            usize::from(metric != Metric::Samples)
        }
        Metric::ViewPoints | Metric::Bits => 0,
        Metric::LatencyWidth | Metric::LatencyFromContact | Metric::PassRate => 1,
        Metric::Samples | Metric::TaxelsSkin | Metric::TaxelsProbed => 1,
        Metric::PressRate | Metric::IdleRate => 3,
        _ => 2,
    }
}

/// Value and interval of a cell.
pub(crate) fn text(cell: &Cell, metric: Metric) -> String {
    match cell {
        Cell::Missing => NONE.to_owned(),
        Cell::Text(text) => (*text).to_owned(),
        Cell::Value(e) if metric == Metric::GlobalError => format::contact_map(e),
        Cell::Value(e) => {
            let digits = digits(metric, e.value);
            let value = number(e.value, digits);
            match interval(e, 1.0, digits) {
                none if none == NONE => value,
                interval => format!("{value} {interval}"),
            }
        }
    }
}

/// Comparison with MSOWS.
pub(super) fn msows(input: &ReportInput<'_>) -> Table {
    let session = format!("#{}", own_name(input));
    let mut grid = Table::new(
        "comparison-msows",
        "This session, the paper and MSOWS",
        &[
            "Quantity",
            &session,
            "#at 1/1024, emulated",
            "#paper, published",
            "#paper at 1/1024, published",
            "#MSOWS, published",
            "See",
        ],
    );
    for r in rows(input.analysis) {
        grid.row([
            r.metric.name().to_owned(),
            text(&r.session, r.metric),
            text(&r.reduced, r.metric),
            r.paper.to_owned(),
            r.paper_reduced.to_owned(),
            r.msows.to_owned(),
            r.notes.to_owned(),
        ]);
    }
    grid.note(
        "Paper: Koolani et al., An Event-Based Opto-Tactile Skin. MSOWS: Lo Preti et al. 2022, as quoted in the paper. \
         Brackets: 95 % intervals over locations, this session. At 1/1024: one event in 1024 kept at random (exact \
         count, as in the public code), emulated on the recording; RMSE and rates come from the reduction study.",
    );
    for f in &published::FOOTNOTES {
        grid.note(format!("{}: {}", f.mark, f.text));
    }
    grid.download("comparison").fold();
    grid
}

/// Row of this session in the lists of skins and sensors: RMSE with n.
fn own(input: &ReportInput<'_>) -> String {
    let e = &input.analysis.scored.rmse_mm;
    if e.value.is_none() {
        return NONE.to_owned();
    }
    format!(
        "RMSE {} mm {}, n = {}",
        number(e.value, 2),
        interval(e, 1.0, 2),
        e.n
    )
}

fn own_name(input: &ReportInput<'_>) -> String {
    match input.provenance.stand_in() {
        Some(word) => format!("this session, {word}"),
        None => "this session".to_owned(),
    }
}

/// The paper's table of tactile localisation technologies, with the session as its last row.
pub(super) fn skins(input: &ReportInput<'_>) -> Table {
    let mut grid = Table::new(
        "comparison-skins",
        "Other skins that locate touch",
        &[
            "Skin", "Source", "Touches", "Material", "Accuracy", "Method",
        ],
    );
    for s in &published::SKINS {
        grid.row(
            [
                s.name, s.source, s.touches, s.material, s.accuracy, s.method,
            ]
            .map(str::to_owned),
        );
    }
    grid.row(
        [
            "event-based opto-tactile skin",
            "Koolani et al., the paper",
            "single",
            "silicone",
            "RMSE 4.66 mm",
            "stereo, DBSCAN",
        ]
        .map(str::to_owned),
    );
    grid.marked_row(
        [
            own_name(input),
            "here".to_owned(),
            "single".to_owned(),
            NONE.to_owned(),
            own(input),
            own_method(input),
        ],
        true,
    );
    grid.note("All rows but the last are published values collected by the paper. Areas, loads and evaluation methods differ: not a ranking.");
    grid.fold();
    grid
}

/// How the session's columns and positions were found.
fn own_method(input: &ReportInput<'_>) -> String {
    let settings = &input.analysis.settings;
    let estimator = match settings.estimator {
        Estimator::Dbscan => "DBSCAN",
        Estimator::ColumnMedian => "median column",
        Estimator::HistogramPeak => "peak of the columns",
        Estimator::Streaming => "running histogram",
    };
    format!("stereo, {estimator}")
}

/// The paper's overview of optical tactile sensors, with the session as its last row.
pub(super) fn sensors(input: &ReportInput<'_>) -> Table {
    let mut grid = Table::new(
        "comparison-sensors",
        "Optical tactile sensors",
        &[
            "Sensor", "Source", "Hardware", "Measures", "Method", "Result",
        ],
    );
    for s in &published::SENSORS {
        grid.row([s.name, s.source, s.hardware, s.measures, s.method, s.result].map(str::to_owned));
    }
    let width = input
        .analysis
        .latency
        .as_ref()
        .and_then(|l| l.width_ms.value);
    let width = width.map_or_else(String::new, |w| {
        format!("; onsets spread over {} ms (5-95 %)", number(Some(w), 1))
    });
    grid.marked_row(
        [
            own_name(input),
            "here".to_owned(),
            "2 event cameras".to_owned(),
            "location".to_owned(),
            own_method(input),
            format!("{}{width}", own(input)),
        ],
        true,
    );
    grid.note("All rows but the last are published values collected by the paper. Most measure something else: not a ranking.");
    grid.fold();
    grid
}

/// The public code's evaluation beside ours. `None` outside reference-code mode.
pub(super) fn reference(a: &Analysis) -> Option<Table> {
    let r = a.reference.as_ref()?;
    let mut grid = Table::new(
        "reference-table",
        "In-sample, as published, beside held-out",
        &[
            "Quantity",
            "#public code, in-sample",
            "#this report, held-out",
            "#Published",
        ],
    );
    let m = &a.scored;
    let mm = |v: Option<f64>| number(v, 2);
    let mut row = |name: &str, code: &str, ours: &str, published: &str| {
        grid.row([name, code, ours, published]);
    };
    let inside = format!("{} inside the square", r.inside);
    let scored = m.located_rate.n.to_string();
    row("presses", &r.presses.to_string(), &scored, "250");
    row(
        "with two centroids",
        &r.with_centroids.to_string(),
        NONE,
        NONE,
    );
    row("judged", &inside, &m.rmse_mm.n.to_string(), NONE);
    for (name, code, ours, theirs) in [
        ("RMSE (mm)", r.rmse_mm, m.rmse_mm, published::RMSE_MM),
        (
            "RMSE along x (mm)",
            r.rmse_x_mm,
            m.rmse_x_mm,
            published::RMSE_X_MM,
        ),
        (
            "RMSE along y (mm)",
            r.rmse_y_mm,
            m.rmse_y_mm,
            published::RMSE_Y_MM,
        ),
    ] {
        row(name, &mm(code), &mm(ours.value), &mm(Some(theirs)));
    }
    row(
        "std of the error lengths (mm)",
        &mm(r.std_of_errors_mm),
        NONE,
        NONE,
    );
    let theirs = mm(Some(published::REPEAT_STD_MM));
    row(
        "std between repetitions (mm)",
        NONE,
        &mm(m.repeat_std_mm.value),
        &theirs,
    );
    let own = a.calibration.as_ref();
    for (name, value) in &r.parameters {
        let index = own.and_then(|c| c.names.iter().position(|n| n == name));
        let ours = own.zip(index).and_then(|(c, i)| c.values.get(i));
        grid.row([
            name.clone(),
            number(Some(*value), 3),
            number(ours.copied(), 3),
            NONE.to_owned(),
        ]);
    }
    grid.note(
        "In-sample: evaluated on the calibration presses, without those outside the enclosing square, which favours \
         whatever was fitted. Held-out: evaluated on presses that did not calibrate.",
    );
    if !r.calibrated {
        grid.note(
            "These presses determine no plausible calibration with the public code's choices. The nominal camera \
             geometry was used instead, so the in-sample numbers do not describe the skin.",
        );
    }
    Some(grid)
}

/// The public code's data reduction beside ours.
pub(super) fn reference_reduction(a: &Analysis) -> Option<Table> {
    let r = a.reference.as_ref()?;
    if r.reduction.is_empty() {
        return None;
    }
    let mut grid = Table::new(
        "reference-reduction",
        "Data reduction as in the public code",
        &[
            "k",
            "#RMSE, public code (mm)",
            "#RMSE, this report (mm)",
            "#pass rate, public code (%)",
            "#pass rate, failures counted as failed (%)",
            "#pass rate, this report (%)",
        ],
    );
    let ours = |factor: u32| {
        let curves = &a.reduction.as_ref()?.curves;
        let curve = curves.iter().find(|c| c.thinning == Thinning::Exact)?;
        curve.rows.iter().find(|row| row.factor == factor)
    };
    let percent = |v: f64| number(Some(100.0 * v), 1);
    for row in &r.reduction {
        let mine = ours(row.factor);
        grid.row([
            row.factor.to_string(),
            number(row.rmse_mm, 2),
            number(mine.and_then(|m| m.rmse_mm.value), 2),
            percent(row.pass_rate),
            percent(row.honest_pass_rate),
            number(mine.and_then(|m| m.pass_rate.value).map(|v| 100.0 * v), 1),
        ]);
    }
    grid.note(
        "In the public code a press without an estimate counts with the largest error found, which can pass.",
    );
    grid.download("reference_reduction");
    Some(grid)
}
