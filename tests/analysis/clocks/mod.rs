//! Clock fits: from trigger marks with all their faults, and from the presses themselves.

#![expect(clippy::print_stdout, reason = "the table of the documentation")]
#![expect(clippy::unwrap_used, reason = "tests")]

mod shifts;
mod simulated;

use skinrig_analysis::clock::{LineError, MarksError, PressSpan, fit_marks, fit_rates};
use skinrig_analysis::rates::RateHistogram;
use skinrig_analysis::result::{ClockFit, WarningCause};
use skinrig_model::{HostTime, Mark, MarkKind, PressId, PulseTrain, SentMark, TriggerEdge};

/// A planted camera clock: camera = offset + (1 + ppm) host, in whole µs, with jitter.
struct PlantedClock {
    offset_us: f64,
    ppm: f64,
}

impl PlantedClock {
    fn camera_us(&self, host_us: f64) -> f64 {
        self.offset_us + host_us + self.ppm * 1e-6 * host_us
    }
}

/// A small deterministic sequence in -1..1.
fn noise(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed >> 40) as f64) / (1u64 << 23) as f64 - 1.0
}

fn marks(count: usize) -> Vec<SentMark> {
    (0..2 * count)
        .map(|i| SentMark {
            mark: Mark {
                kind: if i % 2 == 0 {
                    MarkKind::Contact
                } else {
                    MarkKind::Release
                },
                press: PressId::from_index((i / 2) as u32),
            },
            t: HostTime((5_000_000_000 + i as i64 * 1_750_111_222) + (noise(i) * 1e6) as i64),
            uncertainty_ns: 1000,
        })
        .collect()
}

fn edges_of(sent: &[SentMark], clock: &PlantedClock, jitter_us: f64) -> Vec<TriggerEdge> {
    let mut edges = Vec::new();
    for (i, mark) in sent.iter().enumerate() {
        let t = clock.camera_us(mark.t.0 as f64 * 1e-3) + jitter_us * noise(7 * i);
        for (rise, width) in PulseTrain::new(mark.mark).unwrap().pulses() {
            for (at, rising) in [(rise, true), (rise + width, false)] {
                edges.push(TriggerEdge {
                    t_us: (t + at as f64).round() as u64,
                    channel: 0,
                    rising,
                });
            }
        }
    }
    edges
}

fn check(fit: &ClockFit, planted: &PlantedClock, span_s: f64, within_us: f64) {
    for k in 0..=10 {
        let host_us = 5e6 + span_s * 1e5 * f64::from(k);
        let error = fit.camera_us(host_us) - planted.camera_us(host_us);
        assert!(
            error.abs() < within_us,
            "{error} µs off at {host_us} µs: {fit:?}"
        );
        assert!((fit.host_us_of_camera(fit.camera_us(host_us)) - host_us).abs() < 0.01);
    }
}

#[test]
fn marks_give_the_clock_to_a_fraction_of_a_microsecond_even_after_hours_and_at_huge_counters() {
    for (offset_us, ppm) in [
        (12.5e6, 23.4),
        ((1u64 << 44) as f64 + 0.25, -41.7),
        (3e6, 0.0),
    ] {
        let planted = PlantedClock { offset_us, ppm };
        let sent = marks(2500);
        let found = fit_marks(&edges_of(&sent, &planted, 2.0), 0, &sent).unwrap();
        assert_eq!((found.fit.n, found.fit.rejected), (5000, 0));
        assert!((found.fit.drift_ppm - ppm).abs() < 5.0 * found.fit.drift_se_ppm + 1e-5);
        assert!(found.fit.drift_se_ppm < 1e-4, "{:?}", found.fit);
        assert!(found.fit.residual_rms_us < 2.0 && found.fit.residual_max_us < 3.5);
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        check(&found.fit, &planted, 8700.0, 0.15);
    }
}

#[test]
fn lost_doubled_late_and_foreign_pulses_do_no_harm() {
    let planted = PlantedClock {
        offset_us: 9e6,
        ppm: 30.0,
    };
    let mut sent = marks(60);
    let mut edges = edges_of(&sent, &planted, 1.0);
    // Press 30's contact is attempted again later: the same name twice.
    let repeated = SentMark {
        t: HostTime(sent[119].t.0 + 900_000_000),
        ..sent[60]
    };
    edges.extend(edges_of(&[repeated], &planted, 0.0));
    sent.push(repeated);
    // One train loses the end of its start pulse, one arrives 3 ms late; between them a foreign pulse and another channel's
    // edges.
    for edge in &mut edges[64 * 20..64 * 21] {
        edge.t_us += 3_000;
    }
    edges.remove(64 * 10 + 1);
    let at = edges[64 * 40].t_us - 100_000;
    edges.insert(
        64 * 40 - 1,
        TriggerEdge {
            t_us: at,
            channel: 0,
            rising: true,
        },
    );
    edges.insert(
        64 * 50,
        TriggerEdge {
            t_us: at,
            channel: 6,
            rising: true,
        },
    );
    let found = fit_marks(&edges, 0, &sent).unwrap();
    assert_eq!(found.fit.n, 121 - 2, "{found:?}");
    assert_eq!(found.fit.rejected, 1);
    check(&found.fit, &planted, 200.0, 1.0);
    let expected = [
        WarningCause::MarksRejected {
            rejected: 1,
            of: 120,
        },
        WarningCause::MarksUnseen { unseen: 1, of: 121 },
        WarningCause::StrayEdges {
            edges: 64,
            channel: 0,
        },
    ];
    assert_eq!(found.warnings, expected);
}

#[test]
fn too_few_marks_give_no_clock() {
    let planted = PlantedClock {
        offset_us: 9e6,
        ppm: 30.0,
    };
    let refused = |planted: &PlantedClock, sent: &[SentMark], channel| {
        let edges = edges_of(sent, planted, 0.0);
        fit_marks(&edges, channel, sent).unwrap_err()
    };
    let few = MarksError::Line {
        line: LineError::FewPairs { found: 2 },
    };
    assert_eq!(refused(&planted, &marks(1)[..2], 0), few);
    assert_eq!(
        fit_marks(&[], 0, &marks(9)).unwrap_err(),
        MarksError::NoneSeen
    );
    assert_eq!(refused(&planted, &marks(9), 6), MarksError::NoneSeen);
    // Times in another unit are seen, but are those of no clock.
    let fast = PlantedClock {
        ppm: 20_000.0,
        ..planted
    };
    let refused = refused(&fast, &marks(9), 0);
    let MarksError::Drift {
        drift_ppm,
        most_ppm: 10_000.0,
    } = refused
    else {
        panic!("expected a drift that is too large, found {refused}")
    };
    assert!((drift_ppm - 20_000.0).abs() < 1.0, "{drift_ppm}");
}

/// The published rhythm: three sync presses 1 s apart, 3 s of rest, then a press every 3 + 1/289 s.
fn rhythm(count: usize) -> Vec<PressSpan> {
    let sync = (0..3).map(f64::from);
    let grid = (0..count).map(|i| 5.0 + i as f64 * (3.0 + 1.0 / 289.0));
    sync.chain(grid)
        .map(|s| PressSpan {
            contact_us: s * 1e6,
            release_us: (s + 0.55) * 1e6,
            sync: s < 4.0,
        })
        .collect()
}

fn histogram(bytes: &[u8]) -> RateHistogram {
    let mut h = RateHistogram::new(10_000);
    for (bin, count) in bytes.iter().enumerate() {
        (0..*count).for_each(|_| h.add(bin as u64 * 10_000));
    }
    h
}

#[test]
fn presses_of_a_recording_give_its_clock() {
    // Expected: drift and start from the mean times of the OFF events of each press burst, fitted over 288 presses by
    // another program; the first contact is 93 ms before the burst's mean in both cameras.
    for (bytes, contact_s, drift_ppm) in [
        (
            include_bytes!("../fixtures/rates_camera1.u8").as_slice(),
            16.516,
            -32.0,
        ),
        (
            include_bytes!("../fixtures/rates_camera2.u8").as_slice(),
            8.753,
            16.7,
        ),
    ] {
        let (found, evidence) = fit_rates(&histogram(bytes), &rhythm(289)).unwrap();
        let fit = found.fit;
        assert!((fit.offset_us * 1e-6 - contact_s).abs() < 0.02, "{fit:?}");
        assert!(
            (fit.drift_ppm - drift_ppm).abs() < 3.0 * fit.drift_se_ppm,
            "{fit:?}"
        );
        assert!(
            fit.drift_se_ppm < 3.0 && fit.residual_rms_us < 12_000.0,
            "{fit:?}"
        );
        assert!(fit.n > 280, "{fit:?}");
        assert!(evidence.log_odds > 15.0, "{evidence:?}");
        assert!(found.warnings.is_empty(), "{found:?}");
    }
}

#[test]
fn a_recording_that_begins_late_or_ends_early_is_still_aligned() {
    let whole = include_bytes!("../fixtures/rates_camera1.u8");
    // Without the first 60 s (sync presses and 13 more are missing), and without the last 100 s.
    for (from, to) in [(6_000, whole.len()), (0, whole.len() - 10_000)] {
        let (found, _) = fit_rates(&histogram(&whole[from..to]), &rhythm(289)).unwrap();
        let contact_s = 16.516 - from as f64 * 0.01;
        assert!(
            (found.fit.offset_us * 1e-6 - contact_s).abs() < 0.02,
            "{found:?}"
        );
        assert!(found.fit.rejected > 10, "{found:?}");
    }
}

/// A long recording: presses of very different strength, every seventh barely visible, slow decay after each.
fn long_recording(presses: &[PressSpan], clock: &PlantedClock) -> RateHistogram {
    let mut h = RateHistogram::new(10_000);
    let end = clock.camera_us(presses[presses.len() - 1].release_us) + 8e6;
    for bin in 0..(end / 1e4) as usize {
        (0..(2.0 + 1.5 * noise(bin)) as u32).for_each(|_| h.add(bin as u64 * 10_000));
    }
    for (i, press) in presses.iter().enumerate() {
        let strength = if i % 7 == 3 {
            2.0
        } else {
            30.0 + 20.0 * noise(3 * i + 1)
        };
        let contact = clock.camera_us(press.contact_us);
        for k in 0..200 {
            let after = f64::from(k) * 0.01;
            let level = match k {
                0..16 => 1.0,
                34..55 => 0.7,
                _ => 0.3 * libm::exp(-after / 0.8),
            };
            let t = contact + f64::from(k) * 1e4;
            (0..(strength * level) as u32).for_each(|_| h.add(t as u64));
        }
    }
    h
}

#[test]
fn drift_over_hours_is_followed() {
    let presses = rhythm(1200);
    for ppm in [-160.0, 0.0, 90.0] {
        let planted = PlantedClock {
            offset_us: 31e6,
            ppm,
        };
        let (found, evidence) = fit_rates(&long_recording(&presses, &planted), &presses).unwrap();
        assert!((found.fit.drift_ppm - ppm).abs() < 3.0, "{found:?}");
        check(&found.fit, &planted, 3600.0, 30_000.0);
        assert!(evidence.log_odds > 15.0, "{evidence:?}");
    }
}

#[test]
fn a_train_without_landmarks_has_no_odds() {
    // Equal steps, and the camera saw neither the beginning nor the end: all whole shifts look alike.
    let presses: Vec<PressSpan> = rhythm(103).split_off(3);
    let planted = PlantedClock {
        offset_us: 31e6,
        ppm: 0.0,
    };
    let whole = long_recording(&presses, &planted);
    let mut middle = RateHistogram::new(10_000);
    for (bin, count) in whole.counts().iter().enumerate().take(26_000).skip(9_000) {
        (0..*count).for_each(|_| middle.add(bin as u64 * 10_000));
    }
    let (_, evidence) = fit_rates(&middle, &presses).unwrap();
    assert!(evidence.log_odds < 1.0, "{evidence:?}");
}

#[test]
fn no_presses_in_the_rates_is_said() {
    let mut flat = RateHistogram::new(10_000);
    (0..90_000u64).for_each(|bin| (0..3).for_each(|_| flat.add(bin * 10_000)));
    let why = fit_rates(&flat, &rhythm(289)).unwrap_err().to_string();
    assert!(why.contains("expected presses to stand out"), "{why}");
    let why = fit_rates(&RateHistogram::new(10_000), &rhythm(289))
        .unwrap_err()
        .to_string();
    assert!(why.contains("expected presses to stand out"), "{why}");
    let mut endless = rhythm(9);
    endless[11].release_us = 1e18;
    let why = fit_rates(&flat, &endless).unwrap_err().to_string();
    assert!(why.contains("within two days"), "{why}");
    let why = fit_rates(&flat, &rhythm(0)).unwrap_err().to_string();
    assert!(why.contains("expected at least 4 presses"), "{why}");
}
