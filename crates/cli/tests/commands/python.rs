//! Exports read back by other programs, and the code of `docs/how-to/python.md` that needs no package; the tests of
//! the package (`tests/python/package`) run the rest.
//!
//! `SKINRIG_PYTHON` names an interpreter with the packages of `tests/python/requirements.txt`.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use skinrig_analysis::Analysis;
use skinrig_formats::Decoder;
use skinrig_model::{CameraId, HostTime, Polarity, StreamFormat};
use skinrig_recorder::SessionReader;

use crate::support::{Lab, ROOT, SMALL, chunks, only, read_json, skinrig, text};

/// Columns of a table, in order of their names in `order`.
#[derive(Default)]
struct Truth {
    order: Vec<String>,
    columns: BTreeMap<String, Vec<Value>>,
}

impl Truth {
    fn put(&mut self, name: &str, value: Value) {
        if !self.columns.contains_key(name) {
            self.order.push(name.to_owned());
        }
        self.columns.entry(name.to_owned()).or_default().push(value);
    }

    /// As JSON whose keys keep their order.
    fn write(&self, folder: &Path, name: &str) {
        let columns: Vec<String> = self
            .order
            .iter()
            .map(|n| format!("{}: {}", json!(n), json!(self.columns[n])))
            .collect();
        let text = format!("{{{}}}", columns.join(", "));
        std::fs::write(folder.join(format!("{name}.json")), text).unwrap();
    }
}

/// Path of the interpreter; `None`, with the reason on standard error, without one.
pub(crate) fn interpreter() -> Option<String> {
    let python = std::env::var("SKINRIG_PYTHON").ok();
    if python.is_none() {
        eprintln!("skipped: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt");
    }
    python
}

#[track_caller]
fn succeeds(mut command: Command) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Expected table of presses, from the session and its results.
fn presses(session: &Path, analysis: &Analysis) -> Truth {
    let reader = SessionReader::open(session).unwrap();
    let (id, header) = (reader.session_id().unwrap(), reader.header().unwrap());
    let mut table = Truth::default();
    for (i, (planned, attempts)) in reader.presses().unwrap().iter().enumerate() {
        let mut put = |name: &str, value: Value| table.put(name, value);
        let found = &analysis.presses[i];
        let last = attempts.last().unwrap().outcome.as_ref().unwrap();
        put("session_id", json!(id));
        put("prototype", json!(header.prototype));
        put("press", json!(planned.id));
        put("role", json!(planned.role));
        put("repetition", json!(planned.repetition));
        put("location", json!(planned.location));
        put("x_mm", json!(planned.at.x_mm));
        put("y_mm", json!(planned.at.y_mm));
        put("depth_mm", json!(planned.depth_mm));
        put("attempts", json!(attempts.len()));
        put("verdict", json!(found.verdict));
        put("reason", json!(found.reason()));
        put("truth_source", json!("measured"));
        let t = last.timing.unwrap();
        let moments: [(&str, HostTime); 6] = [
            ("approach_s", t.approach),
            ("contact_s", t.contact),
            ("at_depth_s", t.at_depth),
            ("retract_s", t.retract),
            ("release_s", t.release),
            ("clear_s", t.clear),
        ];
        for (name, t) in moments {
            put(name, json!(t.as_secs_f64()));
        }
        put("measured_x_mm", json!(last.measured_at.unwrap().x_mm));
        put("measured_y_mm", json!(last.measured_at.unwrap().y_mm));
        put("measured_depth_mm", json!(last.measured_depth_mm));
        put("touched_mm", json!(last.touched_mm));
        put("peak_force_n", json!(last.peak_force_n));
        put("outcome", json!(found.location_outcome.name()));
        let estimate = found.estimate();
        put("estimate_x_mm", json!(estimate.map(|p| p.x_mm)));
        put("estimate_y_mm", json!(estimate.map(|p| p.y_mm)));
        let error = found.error_mm();
        put("error_x_mm", json!(error.map(|e| e.0)));
        put("error_y_mm", json!(error.map(|e| e.1)));
        put("error_mm", json!(error.map(|(x, y)| libm::hypot(x, y))));
        let outcome = serde_json::to_value(found.location_outcome).unwrap();
        put("ray_sine", outcome["sine"].clone());
        let region = found.region;
        put("region_major_mm", json!(region.map(|r| r.semi_axes_mm[0])));
        put("region_minor_mm", json!(region.map(|r| r.semi_axes_mm[1])));
        put("region_angle_deg", json!(region.map(|r| r.angle_deg)));
        let beyond = estimate.map(|_| u8::from(found.extrapolated));
        put("extrapolated", json!(beyond));
        let own = analysis.indentation.as_ref();
        let own = own.and_then(|all| all.of(planned.id));
        for (name, unit, of) in [
            ("depth", "mm", own.and_then(|p| p.depth_mm)),
            ("force", "n", own.and_then(|p| p.force_n)),
        ] {
            let ends = of.and_then(|r| r.interval);
            put(
                &format!("estimate_{name}_{unit}"),
                json!(of.map(|r| r.value)),
            );
            put(
                &format!("estimate_{name}_low_{unit}"),
                json!(ends.map(|e| e[0])),
            );
            put(
                &format!("estimate_{name}_high_{unit}"),
                json!(ends.map(|e| e[1])),
            );
        }
        put("rest_mm", json!(own.and_then(|p| p.rest_mm)));
        views(&mut put, analysis, i, [t.contact, t.release]);
    }
    table
}

fn views(put: &mut impl FnMut(&str, Value), analysis: &Analysis, i: usize, touch: [HostTime; 2]) {
    for k in 0..2 {
        let view = analysis.presses[i].views[k];
        let clock = analysis.clocks[k].unwrap();
        let mut put = |what: &str, value: Value| put(&format!("camera{}_{what}", k + 1), value);
        put("contact_us", json!(clock.camera_us_of_host(touch[0])));
        put("release_us", json!(clock.camera_us_of_host(touch[1])));
        put("events", json!(view.map(|v| v.events)));
        put("on_events", json!(view.map(|v| v.on_events)));
        put("clusters", json!(view.map(|v| v.clusters)));
        put("cluster_events", json!(view.map(|v| v.cluster_events)));
        put("centroid_u_px", json!(view.and_then(|v| v.centroid_u)));
        put("centroid_v_px", json!(view.and_then(|v| v.centroid_v)));
        put("rate_per_s", json!(view.map(|v| v.rate_per_s)));
        let idle = view.filter(|v| v.idle_s > 0.0);
        put("idle_rate_per_s", json!(idle.map(|v| v.idle_rate_per_s)));
    }
}

/// Expected table of results, from the document that `analyze` writes.
fn results(document: &Value) -> Truth {
    let analysis = &document["analysis"];
    let mut table = Truth::default();
    let mut row = |set: &str, metric: &str, unit: &str, depth: &Value, found: &Value| {
        table.put("session_id", document["provenance"]["session_id"].clone());
        table.put("prototype", document["provenance"]["prototype"].clone());
        table.put("set", json!(set));
        table.put("metric", json!(metric));
        table.put("unit", json!(unit));
        table.put("depth_mm", depth.clone());
        for key in ["value", "low", "high", "n"] {
            table.put(key, found[key].clone());
        }
        table.put("valid", document["valid"].clone());
    };
    let metrics = [
        "rmse",
        "rmse_x",
        "rmse_y",
        "bias_x",
        "bias_y",
        "median",
        "p95",
        "repeat_std",
    ];
    for set in ["scored", "scored_without_exclusions"] {
        for metric in metrics {
            let found = &analysis[set][format!("{metric}_mm")];
            row(set, metric, "mm", &Value::Null, found);
        }
        for rate in ["located_rate", "within_rate"] {
            row(set, rate, "1", &Value::Null, &analysis[set][rate]);
        }
        if set == "scored" {
            for depth in analysis["depths"].as_array().unwrap() {
                row(set, "rmse", "mm", &depth["depth_mm"], &depth["rmse_mm"]);
            }
        }
    }
    let penalised = &analysis["penalised"]["rmse_mm"];
    row("penalised", "rmse", "mm", &Value::Null, penalised);
    table
}

fn pose(session: &Path) -> Truth {
    let reader = SessionReader::open(session).unwrap();
    let mut table = Truth::default();
    for s in reader
        .poses(HostTime(i64::MIN), HostTime(i64::MAX))
        .unwrap()
    {
        table.put("t_ns", json!(s.t.0));
        for (which, at) in [
            ("commanded", s.commanded.to_array()),
            ("measured", s.measured.to_array()),
        ] {
            for (axis, value) in ["x", "y", "z"].iter().zip(at) {
                table.put(&format!("{which}_{axis}_mm"), json!(value));
            }
        }
        table.put("force_n", json!(Some(s.force_n).filter(|f| !f.is_nan())));
    }
    table
}

fn events(session: &Path, camera: CameraId) -> Vec<u8> {
    let mut decoder = Decoder::new(StreamFormat::Evt2);
    let mut packed = Vec::new();
    for chunk in chunks(session, camera) {
        decoder.for_each_slice(&chunk, |events| {
            for e in events {
                packed.extend(e.t_us.to_le_bytes());
                packed.extend(e.x.to_le_bytes());
                packed.extend(e.y.to_le_bytes());
                packed.push(u8::from(e.polarity == Polarity::On));
            }
        });
    }
    packed
}

/// Asserts that the page explains every column; `cameraN_...` stands for those of both cameras.
fn assert_documented(page: &str, table: &Truth) {
    for name in &table.order {
        let name = ["camera1_", "camera2_"]
            .iter()
            .find_map(|camera| name.strip_prefix(camera))
            .map_or_else(|| name.clone(), |rest| format!("cameraN_{rest}"));
        assert!(
            page.contains(&format!("`{name}`")),
            "docs/reference/exports.md: {name}"
        );
    }
}

#[test]
fn exports_are_read_back_in_python_and_the_page_about_it_runs() {
    let Some(python) = interpreter() else { return };
    let lab = Lab::new();
    skinrig(&["run", SMALL, "--sessions", &lab.text("s")]).code(0);
    let session = only(&lab.path("s"), ".session.sqlite");
    let out = lab.text("export");
    skinrig(&["export", &text(&session), "--to", "all", "--out", &out]).code(0);

    let truth = lab.path("truth");
    std::fs::create_dir(&truth).unwrap();
    let document = read_json(&only(&lab.path("s"), ".results.json"));
    // The analysis itself: its document omits bulk data that only figures need.
    let analysis = skinrig::results::analyze_session(&session, Default::default());
    let analysis = analysis.map_err(|e| e.message).unwrap().analysis;
    let page = std::fs::read_to_string(format!("{ROOT}/docs/reference/exports.md")).unwrap();
    for (name, table) in [
        ("presses", presses(&session, &analysis)),
        ("results", results(&document)),
        ("pose", pose(&session)),
    ] {
        assert_documented(&page, &table);
        table.write(&truth, name);
    }
    for camera in CameraId::ALL {
        let name = format!("events_camera{}.bin", camera.number());
        std::fs::write(truth.join(name), events(&session, camera)).unwrap();
    }
    let name = session.file_name().unwrap().to_str().unwrap();
    let stem = name.strip_suffix(".session.sqlite").unwrap();
    let mut read_back = Command::new(&python);
    read_back.arg(format!("{ROOT}/tests/python/read_back.py"));
    read_back.args([&out, stem, &text(&truth)]);
    // 54 + 10 + 8 columns in three formats, 4 in six or more for each camera.
    let compared = succeeds(read_back);
    let compared: u32 = compared.split(' ').next().unwrap().parse().unwrap();
    assert!(compared >= 3 * 72 + 2 * 4 * 6, "{compared}");

    let page = std::fs::read_to_string(format!("{ROOT}/docs/how-to/python.md")).unwrap();
    let (_, page) = page.split_once("## Without the package").unwrap();
    let code: Vec<&str> = page.split("```python\n").skip(1).collect();
    let code = code.iter().map(|block| block.split("```").next().unwrap());
    let code = code.collect::<String>();
    let mut plots = Command::new(&python);
    plots.current_dir(lab.path("")).args(["-c", &code]);
    succeeds(plots);
    let bytes = std::fs::read(lab.path("path.png")).unwrap();
    assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5_000);
}
