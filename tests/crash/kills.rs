//! Killing the process: at every journal write, at random times, and again during a resumed run.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use super::lab::{
    BaselineCampaign, SeededRandom, assert_resumes, campaign, expect, journal, resume, session_in,
};

/// Number of random kills.
fn crashes() -> u64 {
    let requested = std::env::var("SKINRIG_CRASHES").ok();
    requested.and_then(|n| n.parse().ok()).unwrap_or(10)
}

/// Runs the campaign with a fault; false if it finished before, which ends with exit code 2.
fn run_until_killed(folder: &std::path::Path, fault: &str) -> bool {
    let output = campaign(folder).args(["--fault", fault]).output().unwrap();
    match output.status.code() {
        None => true,
        code => {
            let text = super::lab::output_text(&output);
            let is_over = text.contains(&format!("the run ended without {fault}"));
            assert!(code == Some(2) && is_over, "{text}");
            false
        }
    }
}

/// Kills at journal writes `first`, `first + 2`, ... until the campaign finishes; returns the number of kills.
fn killed_at_every_other_write(first: usize) -> usize {
    for n in (first..).step_by(2) {
        let folder = tempfile::tempdir().unwrap();
        let fault = format!("killed@journal:{n}");
        if !run_until_killed(folder.path(), &fault) {
            return n / 2;
        }
        let session = session_in(folder.path()).unwrap();
        assert_resumes(&session, 1, &fault);
    }
    0
}

// Two tests, so that two processors share the work.
#[test]
fn killed_before_every_odd_journal_write() {
    let kills = killed_at_every_other_write(1);
    assert!(
        kills > 12,
        "{kills}: an intent and an outcome for each of 12 presses"
    );
}

#[test]
fn killed_before_every_even_journal_write() {
    let kills = killed_at_every_other_write(2);
    assert!(
        kills > 12,
        "{kills}: an intent and an outcome for each of 12 presses"
    );
}

#[test]
fn killed_at_random_instants() {
    let took = BaselineCampaign::get().took;
    let mut under_way = 0;
    for seed in 0..crashes() {
        let mut random = SeededRandom(seed);
        let folder = tempfile::tempdir().unwrap();
        let mut command = campaign(folder.path());
        let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let wait = took.mul_f64(random.below(1_000) as f64 / 1_000.0);
        // The time of the kill, not a wait for a condition.
        std::thread::sleep(wait);
        child.kill().unwrap();
        let text = BufReader::new(child.stderr.take().unwrap());
        let ended = child.wait().unwrap().success();
        let case = format!("seed {seed}, killed after {wait:?}");
        // `press 4/12` is printed once the outcome of the fourth press is on the disk.
        let reported = text.lines().map_while(Result::ok).filter_map(|line| {
            let (n, _) = line.strip_prefix("press ")?.split_once('/')?;
            n.parse::<usize>().ok()
        });
        let reported = reported.last().unwrap_or(0);
        let Some(session) = session_in(folder.path()) else {
            assert_eq!(reported, 0, "{case}");
            continue;
        };
        let before = journal(&session).unwrap_or_default();
        let outcomes = before.iter().flat_map(|(_, attempts)| attempts);
        let outcomes = outcomes.filter(|a| a.outcome.is_some()).count();
        assert!(
            outcomes >= reported,
            "{case}: {reported} presses reported, {outcomes} kept"
        );
        if ended {
            continue;
        }
        under_way += u64::from(outcomes > 0);
        if !before.is_empty() && is_sealed(&session) {
            // Either complete in time, or only the end of its seal is missing and gets written.
            let code = resume(&session).output().unwrap().status.code();
            assert!(matches!(code, Some(0 | 2)), "{case}: {code:?}");
            BaselineCampaign::get().assert_matches(&session, 0, &case);
        } else {
            assert_resumes(&session, 1, &case);
        }
    }
    assert!(
        under_way > 0,
        "no crash during the presses: the instants are badly chosen"
    );
}

fn is_sealed(session: &std::path::Path) -> bool {
    let reader = skinrig_recorder::SessionReader::open(session).unwrap();
    reader.seal().unwrap().is_some()
}

#[test]
fn killed_a_second_time_during_resume() {
    for (first, repeated) in [(3, 2), (12, 1), (18, 12), (29, 9)] {
        let folder = tempfile::tempdir().unwrap();
        assert!(run_until_killed(
            folder.path(),
            &format!("killed@journal:{first}")
        ));
        let session = session_in(folder.path()).unwrap();
        let mut leg = resume(&session);
        let output = leg
            .args(["--fault", &format!("killed@journal:{repeated}")])
            .output()
            .unwrap();
        let case = format!(
            "killed at {first}, then at {repeated}: {}",
            super::lab::output_text(&output)
        );
        assert_eq!(output.status.code(), None, "{case}");
        assert_resumes(&session, 2, &case);
    }
}

#[test]
fn killed_before_the_seal() {
    let folder = tempfile::tempdir().unwrap();
    assert!(run_until_killed(folder.path(), "killed@seal"));
    let session = session_in(folder.path()).unwrap();
    // All presses exist: only the seal is missing.
    let text = expect(resume(&session), 0);
    assert!(text.contains("only its seal was missing"), "{text}");
    BaselineCampaign::get().assert_matches(&session, 0, "killed before the seal");
    let text = expect(resume(&session), 2);
    assert!(text.contains("nothing to resume"), "{text}");

    // Same for a further leg.
    let folder = tempfile::tempdir().unwrap();
    assert!(run_until_killed(folder.path(), "killed@journal:20"));
    let session = session_in(folder.path()).unwrap();
    let mut leg = resume(&session);
    let output = leg.args(["--fault", "killed@seal"]).output().unwrap();
    assert_eq!(output.status.code(), None);
    expect(resume(&session), 0);
    BaselineCampaign::get().assert_matches(&session, 1, "killed before the seal of a leg");
}
