//! `skinrig import`: the published dataset's files become a session like any other.
//!
//! The schedule is compiled into a plan and run by the same controller, over a robot that is exactly where the
//! schedule says and cameras that play the files. What was never measured is marked as scheduled.

mod camera;
mod indenter;
mod plan;

use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_controller::{Problem, RunFault};
use skinrig_device::{CameraSettings, Rig};
use skinrig_formats::hdf5::Container;
use skinrig_formats::inspect::FileKind;
use skinrig_formats::positions::{LengthUnit, PositionTable};
use skinrig_formats::raw::RawReader;
use skinrig_formats::regular;
use skinrig_formats::{Geometry, Scanner};
use skinrig_model::{
    CameraId, DeviceIdentity, ExcludedReason, HostDuration, LocationId, Point2, RigidTransform,
    StreamFormat,
};
use skinrig_protocol::Schedule;
use skinrig_sim::SimClock;

use crate::args::ImportArgs;
use crate::conclusion::conclude;
use crate::exit::{Exit, Failure, Outcome};
use crate::fault::FaultInjector;
use crate::looks::LookMode;
use crate::paths::file_name;
use crate::run::{RunInputs, record};
use crate::sense::SenseMode;
use crate::signals::Operator;
use crate::sink::ReplayExpectations;
use crate::terminal::Output;
use camera::{ChunkFeed, FileCamera, RecordingError};
use indenter::ScheduledIndenter;

/// Smallest plausible extent of the presses, mm: less than any indenter's tip.
const SMALLEST_PATH_MM: f64 = 1.0;

/// Imports a dataset.
///
/// # Errors
/// [`Failure::input`] for wrong or damaged files; if a file breaks off, the part before is kept. [`Failure::rig`] when the
/// session cannot be written.
pub(crate) fn import(args: &ImportArgs, command_line: &str, output: Output) -> Outcome {
    let name = args.schedule.to_string_lossy();
    for file in [&args.camera1, &args.camera2, &args.presses] {
        regular::check(file).map_err(|e| Failure::input(format!("{}: {e}", file.display())))?;
    }
    let bytes = regular::read_text(&args.schedule)
        .map_err(|e| Failure::input(format!("{name}: cannot read the schedule: {e}")))?;
    let schedule = Schedule::parse(&name, &bytes, &args.overrides)
        .map_err(|found| Failure::findings(&found))?;
    let positions = read_positions(&args.presses, &schedule)?;
    let (presses, times) = schedule.planned(&positions).map_err(Failure::input)?;
    let unused = ExcludedReason::NotUsed {
        presses_used: schedule.presses_used.to_string(),
    };
    let excluded = presses
        .iter()
        .filter(|p| !schedule.is_used(p))
        .map(|p| (p.id, unused.clone()));
    let known = ReplayExpectations {
        scheduled: true,
        timings: presses
            .iter()
            .map(|p| (p.id, schedule.phases.since_approach()))
            .collect(),
        excluded: excluded.collect(),
        interruption: None,
    };
    let plan = plan::compile(&schedule, presses, &times);

    reject_same_file(args)?;
    let clock = SimClock::new();
    let (one, about_one) = open(CameraId::One, &args.camera1, args.stream1.clone(), &clock)?;
    let (two, about_two) = open(CameraId::Two, &args.camera2, args.stream2.clone(), &clock)?;
    let rig = Rig {
        kind: "imported".into(),
        name: "imported recording".into(),
        indenter: Box::new(ScheduledIndenter::new(clock.clone(), plan::start())),
        cameras: [Box::new(one), Box::new(two)],
        camera_settings: [CameraSettings::default(), CameraSettings::default()],
        trigger_box: None,
        clock: Box::new(clock),
        robot_from_skin: RigidTransform::identity(),
        geometry: schedule.rig,
        description_json: serde_json::json!({
            "kind": "imported", "camera1": about_one, "camera2": about_two,
            "presses": { "file": file_name(&args.presses), "sha256": sha256_of(&args.presses)? },
        })
        .to_string(),
    };
    let last = times.last().map_or(0, |t| t.0);
    if !output.json {
        outln!(
            "import  {} presses by schedule, {:.0} s: {} and {}",
            plan.presses.len(),
            last as f64 * 1e-9,
            args.camera1.display(),
            args.camera2.display()
        );
    }
    let intent = RunInputs {
        text: &schedule.text,
        file_name: &schedule.file_name,
        name: &schedule.name,
        sha256: &schedule.sha256,
        overrides: &args.overrides,
        seed: 0,
        prototype: &schedule.prototype.id,
        operator: &schedule.operator,
        analysis: &schedule.analysis,
        command_line,
        expected: HostDuration(last),
        known,
        fault_injector: FaultInjector::default(),
        looks: LookMode::default(),
        sense: SenseMode::default(),
    };
    let operator = Operator::listen().map_err(Failure::internal)?;
    let (session, report) = record(&intent, &plan, rig, &args.sessions, None, None, &operator)?;
    let unreadable = report
        .end
        .faults()
        .iter()
        .any(|c| matches!(c, RunFault::Device(_)));
    let is_of_a_file = |p: &&Problem| matches!(p.error, RunFault::Device(_));
    let unread = report.problems.iter().find(is_of_a_file);
    if (unreadable || unread.is_some()) && !output.json && !args.no_analysis {
        outln!("DAMAGED   a file was not read to its end: what follows is of the part before");
    }
    let concluded = conclude(&session, &report, args.no_analysis, None, output);
    if let (false, Some(problem)) = (unreadable, unread) {
        // All presses have what they need, but a file was not read to its end.
        if let Err(failure) = concluded {
            errln!("{}", failure.message);
        }
        return Err(Failure::input(format!(
            "{}\n  everything read so far is kept: {}\n  next: mend the file, or cut it where the schedule ends, and import again",
            problem.error,
            session.display()
        )));
    }
    concluded.map_err(|failure| {
        // An import uses no rig: a camera error means that its file is damaged or too short.
        if unreadable {
            Failure {
                exit: Exit::Input,
                ..failure
            }
        } else {
            failure
        }
    })
}

fn read_positions(path: &Path, schedule: &Schedule) -> Result<Vec<Point2>, Failure> {
    // The table supports metres and millimetres; any other unit is scaled from millimetres.
    let (unit, scale) = match schedule.csv_unit_mm {
        1000.0 => (LengthUnit::Metre, 1.0),
        mm => (LengthUnit::Millimetre, mm),
    };
    let table = PositionTable::read(path, unit).map_err(Failure::input)?;
    if !table.blank_lines.is_empty() {
        if !schedule.csv_skip_blank_rows {
            return Err(Failure::input(format!(
                "{}: line(s) {:?} are blank\n  next: remove them, or set csv.skip_blank_rows in the schedule",
                path.display(),
                table.blank_lines
            )));
        }
        errln!(
            "note: {}: skipped blank line(s) {:?}",
            path.display(),
            table.blank_lines
        );
    }
    let points: Vec<Point2> = table
        .presses
        .iter()
        .map(|p| Point2::new(p.x_mm * scale, p.y_mm * scale))
        .collect();
    check_positions(path, schedule, &points)?;
    for note in ignored(schedule, &table, scale) {
        errln!("note: {}: {note}", path.display());
    }
    Ok(points)
}

/// Smallest difference in z that is another depth, mm.
const OTHER_DEPTH_MM: f64 = 0.1;

/// What the table says and the import does not use: depths other than the schedule's, and further columns.
fn ignored(schedule: &Schedule, table: &PositionTable, scale: f64) -> Vec<String> {
    let depth_mm = schedule.depth_mm;
    let z_mm = table.presses.iter().filter_map(|p| p.z_mm);
    let ends = z_mm.map(|z| z * scale).fold(None, |ends, z| {
        let (low, high) = ends.unwrap_or((z, z));
        Some((z.min(low), z.max(high)))
    });
    let depth = ends.and_then(|(low, high)| {
        // Positions on the surface have 0.
        let is = |z: f64| low >= z - OTHER_DEPTH_MM && high <= z + OTHER_DEPTH_MM;
        (!is(0.0) && !is(-depth_mm)).then(|| {
            format!(
                "z from {low:.3} to {high:.3} mm is not used: every press is taken as {depth_mm} mm deep, the `depth` of the schedule"
            )
        })
    });
    let columns = (!table.other_columns.is_empty())
        .then(|| format!("not used: column(s) {}", table.other_columns.join(", ")));
    depth.into_iter().chain(columns).collect()
}

/// Rejects positions off the skin or all on one spot, which a wrong unit causes.
fn check_positions(path: &Path, schedule: &Schedule, points: &[Point2]) -> Result<(), Failure> {
    let next =
        "next: is `csv.unit` of the schedule the unit of this file, and `rig.outline` this skin?";
    let outline = schedule.rig.outline;
    if let Some((row, p)) = (0u32..).zip(points).find(|(_, p)| !outline.contains(**p)) {
        return Err(Failure::input(format!(
            "{}: {} at ({:.3}, {:.3}) mm: expected a location on the skin, found one outside it\n  {next}",
            path.display(),
            LocationId::from_index(row),
            p.x_mm,
            p.y_mm
        )));
    }
    let extent = points
        .iter()
        .map(|p| p.distance_mm(points[0]))
        .fold(0.0, f64::max);
    if points.len() > 1 && extent < SMALLEST_PATH_MM {
        return Err(Failure::input(format!(
            "{}: expected a path of at least {SMALLEST_PATH_MM} mm, found all presses within {extent:.3} mm\n  {next}",
            path.display()
        )));
    }
    Ok(())
}

/// Lower-case hex SHA-256 of a file, which identifies it in the session.
fn sha256_of(path: &Path) -> Result<String, Failure> {
    let unreadable = |e| Failure::input(format!("{}: cannot read it: {e}", path.display()));
    let mut file = std::fs::File::open(path).map_err(unreadable)?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer).map_err(unreadable)? {
            0 => break,
            n => hash.update(&buffer[..n]),
        }
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

/// Rejects one file for both cameras, unless two of its streams are named.
fn reject_same_file(args: &ImportArgs) -> Result<(), Failure> {
    let same = match (args.camera1.canonicalize(), args.camera2.canonicalize()) {
        (Ok(one), Ok(two)) => one == two,
        // Opening the file reports the error.
        _ => false,
    };
    if same && args.stream1 == args.stream2 {
        return Err(Failure::input(format!(
            "{}: expected a recording of each camera, found the same one for both\n  \
             next: correct --camera1 or --camera2, or name two streams of the file with --stream1 and --stream2",
            args.camera1.display()
        )));
    }
    Ok(())
}

/// Opens one camera's file and starts reading it; also returns what the session stores about the file.
fn open(
    camera: CameraId,
    path: &Path,
    stream: Option<String>,
    clock: &SimClock,
) -> Result<(FileCamera, serde_json::Value), Failure> {
    let path = path.to_owned();
    let mut about = serde_json::json!({ "file": file_name(&path), "sha256": sha256_of(&path)? });
    let identity = |model: &str| DeviceIdentity {
        model: model.into(),
        serial: file_name(&path),
        firmware: "none".into(),
    };
    let kind = FileKind::detect(&path).map_err(Failure::input)?;
    let opened = match kind {
        FileKind::Hdf5 => {
            // Open it here first, so that a wrong file is rejected before the session is created.
            let container = Container::open(&path).map_err(Failure::input)?;
            let entry = container
                .choose(stream.as_deref())
                .map_err(Failure::input)?;
            about["stream"] = entry.name.clone().into();
            about["ts_offset_s"] = entry.ts_offset_s.into();
            about["written_by"] = container.written_by().into();
            FileCamera::new(
                camera,
                identity("recorded file (bimvee HDF5, events re-encoded as EVT2)"),
                StreamFormat::Evt2,
                clock.clone(),
                move |feed| read_hdf5(&path, stream.as_deref(), feed),
            )
        }
        FileKind::Raw => {
            if let Some(name) = stream {
                return Err(Failure::input(format!(
                    "{}: expected an HDF5 file with a stream `{name}`, found a RAW file, which has one stream\n  \
                     next: leave out --stream{}",
                    path.display(),
                    camera.index() + 1
                )));
            }
            let reader = RawReader::open(&path).map_err(Failure::input)?;
            let format = reader.header().format;
            check_sensor(&path, &reader).map_err(Failure::input)?;
            check_words(&path, &reader).map_err(Failure::input)?;
            check_format(&path).map_err(Failure::input)?;
            about["header"] = serde_json::json!(reader.header().entries);
            let identity = identity("recorded file (Prophesee RAW, bytes as recorded)");
            FileCamera::new(camera, identity, format, clock.clone(), move |feed| {
                read_raw(&path, feed)
            })
        }
        FileKind::Sqlite | FileKind::Unknown => {
            return Err(Failure::input(format!(
                "{}: expected bimvee HDF5 or Prophesee RAW for {camera}, found another kind of file",
                path.display()
            )));
        }
    };
    Ok((opened.map_err(Failure::internal)?, about))
}

fn read_hdf5(
    path: &Path,
    stream: Option<&str>,
    feed: &mut ChunkFeed,
) -> Result<(), RecordingError> {
    let container = Container::open(path)?;
    let mut events = container.events(stream, Geometry::EVK1)?;
    if events.rows() == 0 {
        return Err(RecordingError::NoEvents { path: path.into() });
    }
    loop {
        let batch = events.next_batch()?;
        if batch.is_empty() || feed.events(batch).is_err() {
            return Ok(());
        }
    }
}

/// Rejects the recording of a sensor of another size.
fn check_sensor(path: &Path, reader: &RawReader) -> Result<(), RecordingError> {
    match reader.header().geometry {
        Some(found) if found != Geometry::EVK1 => Err(RecordingError::OtherSensor {
            path: path.into(),
            width: found.width,
            height: found.height,
        }),
        _ => Ok(()),
    }
}

/// Rejects a stream without words, and one that ends within a word.
fn check_words(path: &Path, reader: &RawReader) -> Result<(), RecordingError> {
    let header = reader.header();
    let word = header.format.word_bytes() as u64;
    match reader.stream_bytes()? {
        0 => Err(RecordingError::NoWords { path: path.into() }),
        stream if stream % word == 0 => Ok(()),
        stream => Err(RecordingError::CutOff {
            path: path.into(),
            word,
            rest: stream % word,
            whole: header.length + stream - stream % word,
        }),
    }
}

/// Bytes at the start of a stream in which its format is tested.
const TESTED_BYTES: u64 = 16 << 20;

/// Rejects a stream most of whose words cannot be of the format in its header.
fn check_format(path: &Path) -> Result<(), RecordingError> {
    let mut reader = RawReader::open(path)?;
    let format = reader.header().format;
    let mut scanner = Scanner::new(format);
    let mut bytes = 0;
    while bytes < TESTED_BYTES {
        let next = reader.next_chunk()?;
        if next.is_empty() {
            break;
        }
        bytes += next.len() as u64;
        scanner.push(next);
    }
    let stats = scanner.stats();
    let words =
        (bytes / format.word_bytes() as u64).saturating_sub(stats.time_high + stats.time_low);
    let strange = stats.skipped_words() + stats.unaligned;
    match 2 * strange > words {
        true => Err(RecordingError::OtherFormat {
            path: path.into(),
            format: format.name(),
            strange,
            words,
        }),
        false => Ok(()),
    }
}

fn read_raw(path: &Path, feed: &mut ChunkFeed) -> Result<(), RecordingError> {
    let mut reader = RawReader::open(path)?;
    loop {
        let bytes = reader.next_chunk()?;
        if bytes.is_empty() || feed.raw(bytes).is_err() {
            return Ok(());
        }
    }
}
