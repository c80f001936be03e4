//! Helpers: the program, the campaign, and the checks of a session resumed after a kill.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use serde_json::Value;
use skinrig_model::{PlannedPress, PressRole, PressVerdict, RunEnd};
use skinrig_recorder::{AttemptRow, SessionReader};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const CAMPAIGN: &str = "tests/crash/campaign.yaml";

/// Every planned press with its attempts.
pub(crate) type Presses = Vec<(PlannedPress, Vec<AttemptRow>)>;

/// Command for the program with these arguments, not yet started.
pub(crate) fn program<S: AsRef<OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skinrig"));
    command.current_dir(ROOT).args(arguments);
    command
}

/// Command that records the campaign in `folder`.
pub(crate) fn campaign(folder: &Path) -> Command {
    let mut command = program(&["run", CAMPAIGN, "--no-analysis", "--sessions"]);
    command.arg(folder);
    command
}

/// Output of a program, for messages.
pub(crate) fn output_text(output: &Output) -> String {
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    format!(
        "{}{}{}",
        output.status,
        text(&output.stdout),
        text(&output.stderr)
    )
}

/// Runs to the end, expects this exit code, and returns the output.
#[track_caller]
pub(crate) fn expect(mut command: Command, code: i32) -> String {
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(code), "{}", output_text(&output));
    output_text(&output)
}

/// The only session of a folder; `None` if the process was killed before creating one.
pub(crate) fn session_in(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?;
    let mut found = entries
        .map(|e| e.unwrap().path())
        .filter(|p| p.to_str().is_some_and(|p| p.ends_with(".session.sqlite")));
    let session = found.next();
    assert!(
        found.next().is_none(),
        "one session in {}",
        folder.display()
    );
    session
}

/// Content of the journal; `None` for a session without a header, which is empty.
pub(crate) fn journal(session: &Path) -> Option<Presses> {
    let reader = SessionReader::open(session).ok()?;
    reader.header().ok()?;
    Some(reader.presses().unwrap())
}

/// The campaign without any fault.
pub(crate) struct BaselineCampaign {
    /// Total duration, including process start.
    pub took: Duration,
    presses: usize,
    counts: Value,
    rmse_interval_mm: [f64; 2],
}

impl BaselineCampaign {
    /// Recorded once for all tests.
    pub(crate) fn get() -> &'static Self {
        static ONCE: OnceLock<BaselineCampaign> = OnceLock::new();
        ONCE.get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let began = Instant::now();
            expect(campaign(folder.path()), 0);
            let took = began.elapsed();
            let session = session_in(folder.path()).unwrap();
            let analysis = analysis(&session);
            let rmse = &analysis["scored"]["rmse_mm"];
            let counts = analysis["counts"].clone();
            assert_eq!(counts["valid"], 10, "{counts}");
            Self {
                took,
                presses: journal(&session).unwrap().len(),
                counts,
                rmse_interval_mm: ["low", "high"].map(|k| rmse[k].as_f64().unwrap()),
            }
        })
    }

    /// Checks that the session is complete and valid, that every scored press has exactly one valid attempt, and that the
    /// results match the uninterrupted campaign: equal counts, an RMSE within its 95 % interval, certified clocks. At most
    /// `kills` attempts may be cut off.
    #[track_caller]
    pub(crate) fn assert_matches(&self, session: &Path, kills: usize, case: &str) {
        let verified = expect(program(&[OsStr::new("verify"), session.as_os_str()]), 0);
        assert!(verified.contains("sound, sealed"), "{case}: {verified}");
        let reader = SessionReader::open(session).unwrap();
        let end = reader.end().unwrap().map(|(_, end)| end);
        assert_eq!(end, Some(RunEnd::Completed), "{case}");
        let presses = journal(session).unwrap();
        assert_eq!(presses.len(), self.presses, "{case}");
        let mut cut_off = 0;
        for (planned, attempts) in &presses {
            let verdict = |a: &AttemptRow| a.outcome.as_ref().map(|o| o.verdict.clone());
            let valid = |a: &&AttemptRow| verdict(a) == Some(PressVerdict::Valid);
            let good = attempts.iter().filter(valid).count();
            assert!(
                attempts.last().is_some_and(|a| valid(&a)),
                "{case}: {attempts:?}"
            );
            if planned.role != PressRole::Sync {
                assert_eq!(good, 1, "{case}: {} made twice: {attempts:?}", planned.id);
            }
            let others = attempts.iter().filter(|a| !valid(a));
            for other in others {
                let verdict = verdict(other);
                assert!(verdict.is_some_and(|v| v.is_cut_off()), "{case}: {other:?}");
                cut_off += 1;
            }
            let numbers: Vec<u32> = attempts.iter().map(|a| a.id.number).collect();
            let chain: Vec<u32> = (1..=attempts.len() as u32).collect();
            assert_eq!(numbers, chain, "{case}: lineage of {}", planned.id);
        }
        assert!(
            cut_off <= kills,
            "{case}: {cut_off} attempts cut off by {kills} kills"
        );
        let analysis = analysis(session);
        assert_eq!(analysis["counts"], self.counts, "{case}");
        assert_eq!(analysis["alignment"]["status"], "valid", "{case}");
        let rmse = analysis["scored"]["rmse_mm"]["value"].as_f64().unwrap();
        let [low, high] = self.rmse_interval_mm;
        assert!(
            (low..=high).contains(&rmse),
            "{case}: {rmse} mm, expected {low} to {high} mm"
        );
    }
}

/// Analyses a session and returns its results.
fn analysis(session: &Path) -> Value {
    let out = session.with_extension("json");
    let [session, json] = [session, &out].map(|p| p.as_os_str());
    let arguments = [OsStr::new("analyze"), session, OsStr::new("--out"), json];
    expect(program(&arguments), 0);
    let results: Value = serde_json::from_slice(&std::fs::read(out).unwrap()).unwrap();
    results["analysis"].clone()
}

/// Earlier records are unchanged: an attempt with an outcome keeps it, one without is marked as cut off.
#[track_caller]
pub(crate) fn assert_kept(before: &Presses, after: &Presses, case: &str) {
    for ((_, before), (planned, after)) in before.iter().zip(after) {
        assert!(after.len() >= before.len(), "{case}: {}", planned.id);
        for (was, is) in before.iter().zip(after) {
            match &was.outcome {
                Some(_) => assert_eq!(was, is, "{case}: {}", planned.id),
                None => {
                    let verdict = is.outcome.as_ref().map(|o| &o.verdict);
                    assert!(
                        verdict.is_some_and(PressVerdict::is_cut_off),
                        "{case}: {is:?}"
                    );
                    assert_eq!(was.id, is.id, "{case}");
                }
            }
        }
    }
}

/// Command for `skinrig resume` of `session`.
pub(crate) fn resume(session: &Path) -> Command {
    let mut command = program(&["resume", "--no-analysis"]);
    command.arg(session);
    command
}

/// Resumes a session after `kills`, and checks that it equals the uninterrupted campaign. A session without a header is
/// rejected and is empty.
#[track_caller]
pub(crate) fn assert_resumes(session: &Path, kills: usize, case: &str) {
    let Some(before) = journal(session) else {
        expect(resume(session), 2);
        return;
    };
    expect(resume(session), 0);
    assert_kept(&before, &journal(session).unwrap(), case);
    BaselineCampaign::get().assert_matches(session, kills, case);
}

/// A small seeded generator of 64-bit numbers (SplitMix64, Steele, Lea and Flood 2014), for test data only.
pub(crate) struct SeededRandom(pub u64);

impl SeededRandom {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform below `n`, which is far below 2^64.
    pub(crate) fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// Random bytes.
    pub(crate) fn bytes(&mut self, n: u64) -> Vec<u8> {
        (0..n).map(|_| self.next() as u8).collect()
    }
}
