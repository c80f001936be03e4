//! `skinrig plan --detect`: locations x repetitions needed to show a difference, from the variance of a session.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::json;
use skinrig_analysis::Analysis;
use skinrig_model::{HostDuration, LocationId, PressRole, Verdict};
use skinrig_statistics::Sample;
use skinrig_statistics::power::{self, MetricVariance, PowerPlan, Target};
use skinrig_text::{Column, Table};

use crate::analysis_request::AnalysisRequest;
use crate::args::DetectArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::progress::clock_text;
use crate::results::{analyze_shown, check_limit};
use crate::selection;

/// Below this number of locations the estimated variance is poor: its 95 % interval spans a factor of 6 or more.
const FEW_LOCATIONS: u32 = 12;

/// Proposes the presses on each of two skins that show a difference in RMSE.
///
/// # Errors
/// [`Failure::input`] for a session that cannot be analysed, has no scored presses, or has too few data; [`Failure::limit`] for an INVALID
/// one.
pub(crate) fn propose(
    difference_mm: f64,
    session: &Path,
    args: &DetectArgs,
    json: bool,
) -> Outcome {
    if selection::sessions(session)?.selection.is_some() {
        return Err(Failure::input(format!(
            "{}: expected one session, found a selection\n  next: name one of its sessions with --from",
            session.display()
        )));
    }
    let results = analyze_shown(session, AnalysisRequest::default())?;
    check_limit(&results, None)?;
    let analysis = results.analysis;
    one_depth(&analysis, session)?;
    let refused = |e: &dyn std::fmt::Display| Failure::input(format!("{}: {e}", session.display()));
    let sample = errors(&analysis).map_err(|e| refused(&e))?;
    let measured = power::measure(&sample).map_err(|e| refused(&e))?;
    let counting = Counting::of(&analysis);
    let target = Target {
        difference: difference_mm,
        power: args.power,
        alpha: args.alpha,
        common: args.common,
        scatter: 1.0 + difference_mm / measured.value,
        // The other skin may lose as many others.
        counting: counting.share() * counting.share(),
        seconds_per_press: seconds_per_press(&analysis),
    };
    let plan = power::plan(&measured, &target).map_err(|e| refused(&e))?;
    let others = presses_besides(&analysis);
    if json {
        crate::terminal::print_json(&json!({
            "session": session, "metric": "rmse", "unit": "mm", "plan": plan, "presses_besides": others,
        }));
    } else {
        print(&plan, counting, others, session);
    }
    Ok(Exit::Ok)
}

/// Rejects a depth sweep: presses of a location at other depths are no repetitions.
fn one_depth(analysis: &Analysis, session: &Path) -> Result<(), Failure> {
    let scored = analysis.presses.iter();
    let scored = scored.filter(|p| p.role == PressRole::Score);
    let mut depths: Vec<f64> = scored.map(|p| p.depth_mm).collect();
    depths.sort_by(f64::total_cmp);
    depths.dedup();
    match depths[..] {
        [] | [_] => Ok(()),
        _ => Err(Failure::input(format!(
            "{}: expected scored presses of one depth, found {} depths: presses at different depths are not repetitions\n  \
             next: name a session of one depth with --from",
            session.display(),
            depths.len()
        ))),
    }
}

/// Error lengths of the scored presses, mm.
fn errors(analysis: &Analysis) -> Result<Sample, skinrig_statistics::SampleFault> {
    let scored = analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid);
    Sample::rms(scored.filter_map(|p| {
        let (x, y) = p.error_mm()?;
        Some((p.location.index(), libm::hypot(x, y)))
    }))
}

/// Scored locations of the session.
#[derive(Clone, Copy)]
struct Counting {
    /// With a press that counts.
    with: usize,
    all: usize,
}

impl Counting {
    fn of(analysis: &Analysis) -> Self {
        let scored = || {
            analysis
                .presses
                .iter()
                .filter(|p| p.role == PressRole::Score)
        };
        let with = scored().filter(|p| p.verdict == Verdict::Valid && p.error_mm().is_some());
        let number = |locations: BTreeSet<LocationId>| locations.len();
        Self {
            with: number(with.map(|p| p.location).collect()),
            all: number(scored().map(|p| p.location).collect()),
        }
    }

    fn share(self) -> f64 {
        self.with as f64 / self.all as f64
    }
}

/// Presses of the session that are not scored.
fn presses_besides(analysis: &Analysis) -> usize {
    let others = analysis.presses.iter();
    others.filter(|p| p.role != PressRole::Score).count()
}

/// The median time from one press to the next, s.
fn seconds_per_press(analysis: &Analysis) -> Option<f64> {
    let begun = analysis.presses.iter().filter_map(|p| p.timing);
    let mut begun: Vec<f64> = begun.map(|t| t.approach.as_secs_f64()).collect();
    begun.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = begun.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).copied().filter(|gap| *gap > 0.0)
}

fn print(plan: &PowerPlan, counting: Counting, others: usize, session: &Path) {
    let Target {
        difference,
        power,
        alpha,
        common,
        ..
    } = plan.target;
    outln!(
        "to show a difference of {difference} mm in RMSE with a power of {} % (two-sided, alpha {} %),",
        shown(100.0 * power),
        shown(100.0 * alpha)
    );
    outln!("press each of the two skins at the same");
    let [number, word] = [Column::right, Column::left];
    let table = Table::new([
        word(1),
        number(9),
        number(11),
        number(7),
        number(10),
        word(0),
    ]);
    let heads = [
        "",
        "locations",
        "repetitions",
        "presses",
        "half width",
        "time for these presses",
    ];
    outln!("{}", table.row(heads));
    for (i, proposal) in plan.proposals.iter().enumerate() {
        let mark = if i == plan.cheapest { "*" } else { "" };
        let time = proposal.seconds.map_or_else(
            || "unknown".to_owned(),
            |s| clock_text(HostDuration::from_secs_f64(s)),
        );
        outln!(
            "{}",
            table.row([
                mark.to_owned(),
                proposal.locations.to_string(),
                proposal.repetitions.to_string(),
                proposal.presses.to_string(),
                format!("{:.3} mm", proposal.half_width),
                time,
            ])
        );
    }
    outln!("* fewest presses; half width: expected, of the interval of the difference");
    if others > 0 {
        outln!(
            "scored presses alone; calibrating and sync presses come on top ({others} in this session)"
        );
    }
    let MetricVariance {
        value,
        between,
        within,
        locations,
    } = plan.measured;
    outln!("");
    outln!("from {}", session.display());
    outln!("  RMSE {value:.3} mm at {locations} locations");
    let Counting { with, all } = counting;
    if with < all {
        outln!(
            "  {} of {all} locations have no press that counts: the proposals allow for as many on both skins",
            all - with
        );
    }
    if locations < FEW_LOCATIONS {
        outln!("  with so few locations these variances are uncertain: use more than proposed");
    }
    outln!(
        "  standard deviation between locations {:.3} mm",
        between.sqrt()
    );
    match within {
        Some(within) => {
            outln!(
                "  standard deviation between repetitions {:.3} mm",
                within.sqrt()
            );
        }
        None => outln!(
            "  no location was pressed twice: the gain from repetitions is unknown, and is part of the above"
        ),
    }
    outln!(
        "  {} % of the variance between locations taken as common to both skins (--common)",
        shown(100.0 * common)
    );
    outln!(
        "  errors are assumed to scatter in proportion to the RMSE: on the worse skin {} times as much",
        shown((plan.target.scatter * 100.0).round() / 100.0)
    );
    outln!(
        "  what changes from mounting to mounting is not known from one session: record each skin at least three times"
    );
}

/// A percentage without the rounding errors of its binary form.
fn shown(percent: f64) -> f64 {
    (percent * 1e6).round() * 1e-6
}
