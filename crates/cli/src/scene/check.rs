//! `skinrig scene check`: statistics of the events of recordings.

use std::path::Path;

use skinrig_analysis::event_statistics::EventStatisticsCollector;
use skinrig_formats::StreamStats;
use skinrig_formats::inspect::FileKind;
use skinrig_formats::raw::RawReader;
use skinrig_model::CameraId;
use skinrig_report::scene_check::{Recording, page, terminal_text};
use skinrig_results::{Origin, SessionEvents, event_statistics};

use crate::analysis_request::AnalysisRequest;
use crate::args::SceneCheckArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::phase::Phase;
use crate::provenance::origin_in_words;
use crate::results::{open, write_named};

/// Recordings that fit side by side on a page.
const MOST_ON_PAGE: usize = 4;

/// Statistics of recordings side by side.
///
/// # Errors
/// [`Failure::input`] for a recording that cannot be read.
pub(super) fn check(args: &SceneCheckArgs, json: bool) -> Outcome {
    let count = args.recordings.len();
    if args.out.is_some() && count > MOST_ON_PAGE {
        return Err(Failure::input(format!(
            "expected at most {MOST_ON_PAGE} recordings for a page, found {count}\n  next: leave out --out, or some of them"
        )));
    }
    let recordings = args.recordings.iter().map(|path| recording(path));
    let recordings = recordings.collect::<Result<Vec<_>, _>>()?;
    if let Some(out) = &args.out {
        write_named(out, page(&recordings).as_bytes())?;
    }
    if json {
        let rows = recordings.iter().map(|r| {
            serde_json::json!({
                "recording": r.name, "origin": r.origin, "cameras": r.cameras, "without_presses": r.without_presses,
                "broken_stream": r.broken_stream,
            })
        });
        let rows: Vec<_> = rows.collect();
        crate::terminal::print_json(&serde_json::json!({ "recordings": rows, "page": args.out }));
    } else {
        outln!("{}", terminal_text(&recordings));
        if let Some(out) = &args.out {
            outln!("\npage  {}", out.display());
        }
    }
    Ok(Exit::Ok)
}

fn recording(path: &Path) -> Result<Recording, Failure> {
    let phase = Phase::begin("reading the events");
    let found = match FileKind::detect(path).map_err(Failure::input)? {
        FileKind::Raw => of_raw(path),
        FileKind::Sqlite => of_session(path),
        FileKind::Hdf5 | FileKind::Unknown => Err(Failure::input(format!(
            "{}: expected a session or a Prophesee RAW file, found neither\n  next: `skinrig import` makes a session of other files",
            path.display()
        ))),
    };
    drop(phase);
    found
}

fn of_raw(path: &Path) -> Result<Recording, Failure> {
    let mut reader = RawReader::open(path).map_err(Failure::input)?;
    let mut decoder = reader.decoder();
    let mut collector = EventStatisticsCollector::new(&[]);
    loop {
        let bytes = reader.next_chunk().map_err(Failure::input)?;
        if bytes.is_empty() {
            break;
        }
        decoder.for_each_slice(bytes, |events| collector.push(events));
    }
    let stats = decoder.stats();
    let events = stats.cd_events();
    let not_events = stats.skipped_words() + stats.dropped_before_address + stats.out_of_geometry;
    if not_events > events {
        return Err(Failure::input(format!(
            "{}: expected a stream of events, found {not_events} words that are none, and {events} events\n  next: `skinrig inspect` \
             counts what the file holds; the recording program states its format and the size of the sensor",
            path.display()
        )));
    }
    Ok(Recording {
        name: path.display().to_string(),
        origin: "RAW file".to_owned(),
        is_stand_in: false,
        without_presses: None,
        broken_stream: broken_stream(&stats),
        cameras: vec![collector.finish(CameraId::One)],
    })
}

/// What of a stream is not in its statistics, or spoils their times.
fn broken_stream(stats: &StreamStats) -> Option<String> {
    let found = [
        (stats.skipped_words(), "words without a meaning"),
        (stats.dropped_before_address, "events without an address"),
        (stats.out_of_geometry, "events outside the sensor"),
        (stats.unaligned, "vectors not aligned to 32 columns"),
        (stats.discontinuities, "jumps of the time base"),
        (stats.trailing_bytes, "bytes of an unfinished word"),
    ];
    let found = found.iter().filter(|(n, _)| *n > 0);
    let found: Vec<String> = found.map(|(n, what)| format!("{what} ({n})")).collect();
    (!found.is_empty()).then(|| found.join(", "))
}

fn of_session(path: &Path) -> Result<Recording, Failure> {
    let (aligned, _) = open(path, AnalysisRequest::default())?;
    let header = aligned.session.header.clone();
    let origin = Origin::of(&header);
    let (name, formats) = (aligned.session.path.clone(), header.stream_formats);
    let events = SessionEvents::new(&name, formats, &aligned.input.legs);
    // The analysis gives the clocks of the cameras. Without it the events are still counted.
    let analysis = aligned.analyze();
    let (analysis, without_presses) = match analysis {
        Ok(found) => (Some(found.analysis), None),
        Err(e) => (None, Some(e.to_string())),
    };
    let cameras = event_statistics(&events, analysis.as_ref())
        .map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
    Ok(Recording {
        name: path.display().to_string(),
        origin: origin_in_words(&header),
        is_stand_in: matches!(origin, Some(Origin::Simulated | Origin::Emulated)),
        without_presses,
        broken_stream: None,
        cameras: cameras.into(),
    })
}
