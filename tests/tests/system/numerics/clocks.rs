//! Clocks and windows: counters at the 34-bit wrap and beyond 2^53, drifts up to 1000 ppm with missing and doubled edges,
//! times out of order.

use skinrig_analysis::analyze;
use skinrig_analysis::clock::{MarksError, PressSpan, RatesError, fit_marks, fit_rates};
use skinrig_analysis::rates::RateHistogram;
use skinrig_analysis::result::{ClockFit, ClockMethod, Warning, WarningCause};
use skinrig_analysis::segment::windows;
use skinrig_formats::{Decoder, evt2::Encoder};
use skinrig_model::{
    AnalysisSettings, HostTime, Mark, MarkKind, PressId, PressTiming, PulseTrain, SentMark,
    StreamFormat, TriggerEdge,
};

use crate::numerics::bounds::{self, UNIT, Watch};
use crate::numerics::precise::{self, Real, real};
use skinrig_planted::Memory;
use skinrig_planted::grid::{Random, session};

const OFFSETS: [f64; 7] = [
    -3e6,
    0.0,
    12_345_678.25,
    17_179_869_183.0,        // 2^34 - 1
    9_007_199_254_740_992.0, // 2^53
    9_007_199_254_740_994.0,
    1_152_921_504_606_846_976.0, // 2^60
];
const DRIFTS: [f64; 7] = [0.0, 1.0, -37.25, 200.0, -500.0, 1000.0, -1000.0];

fn clock(offset_us: f64, drift_ppm: f64) -> ClockFit {
    ClockFit {
        method: ClockMethod::TriggerMarks,
        offset_us,
        drift_ppm,
        drift_se_ppm: 0.0,
        residual_rms_us: 0.0,
        residual_max_us: 0.0,
        n: 3,
        rejected: 0,
    }
}

fn exact_camera(offset_us: f64, drift_ppm: f64, host_us: f64) -> Real {
    real(offset_us) + real(host_us) * (real(1.0) + real(drift_ppm) / real(1e6))
}

#[test]
fn camera_times_are_exact_to_the_last_bit_or_two_of_the_counter() {
    let (there, back) = (
        Watch::new(&bounds::CLOCK_MAP),
        Watch::new(&bounds::CLOCK_BACK),
    );
    for offset in OFFSETS {
        for drift in DRIFTS {
            for host_us in [0.0, 0.5, 1.0, 999_999.75, 3.6e9 + 0.125, 8.64e10, 1e13] {
                let exact = exact_camera(offset, drift, host_us);
                let fit = clock(offset, drift);
                let at = format!("offset {offset}, {drift} ppm, host {host_us} µs");
                let found = fit.camera_us(host_us);
                let size = offset.abs() + host_us;
                if size == 0.0 {
                    assert_eq!(found, 0.0);
                    continue;
                }
                there.record(precise::error(found, &exact) / (UNIT * size), &at);
                let home = fit.host_us_of_camera(precise::near(&exact));
                back.record((home - host_us).abs() / (UNIT * size), &at);
            }
        }
    }
}

#[test]
fn windows_begin_and_end_on_the_right_microsecond_as_long_as_doubles_have_one() {
    let watch = Watch::new(&bounds::WINDOW);
    let settings = AnalysisSettings::default();
    let mut exactly = 0;
    for offset in OFFSETS {
        for drift in DRIFTS {
            for start_ns in [4_000_000_000i64, 3_600_123_456_789, 86_400_000_000_001] {
                let at = |ns: i64| HostTime(start_ns + ns);
                let timing = PressTiming {
                    approach: at(0),
                    contact: at(100_000_000),
                    at_depth: at(200_000_000),
                    retract: at(300_000_000),
                    release: at(400_000_000),
                    clear: at(500_000_000),
                };
                let found = windows(
                    [(0, timing)].into_iter(),
                    &[],
                    &clock(offset, drift),
                    &settings,
                )[0];
                for (edge, host) in [
                    (found.start_us, start_ns + 100_000_000),
                    (found.end_us, start_ns + 400_000_000),
                ] {
                    let side = if edge == found.start_us { -5e4 } else { 5e4 };
                    let exact = real(offset)
                        + real(host as f64) / real(1000.0) * (real(1.0) + real(drift) / real(1e6))
                        + real(side);
                    // The first microsecond at or after the exact instant: 0 to 1 late if all is exact.
                    let late = precise::near(&(real(edge as f64) - &exact));
                    if (0.0..1.0).contains(&late) {
                        exactly += 1;
                    }
                    let size = offset.abs() + host as f64 * 1e-3;
                    let off = (late - 0.5).abs() - 0.5;
                    watch.record(off / (UNIT * size), format!("{offset} {drift} {host}"));
                }
            }
        }
    }
    assert!(exactly > 170, "{exactly} of 294");
}

fn marks(count: u32, period_ns: i64) -> Vec<SentMark> {
    let mark = |i: u32| SentMark {
        mark: Mark {
            kind: if i.is_multiple_of(2) {
                MarkKind::Contact
            } else {
                MarkKind::Release
            },
            press: PressId::from_index(i / 2),
        },
        t: HostTime(5_000_000_000 + i64::from(i) * period_ns),
        uncertainty_ns: 500,
    };
    (0..count).map(mark).collect()
}

/// Edges of one train whose start pulse rises at `t_us`.
fn train(mark: Mark, t_us: u64) -> impl Iterator<Item = TriggerEdge> {
    let pulses = PulseTrain::new(mark).unwrap().pulses();
    pulses.flat_map(move |(rise, width)| {
        [(rise, true), (rise + width, false)].map(|(after, rising)| TriggerEdge {
            t_us: t_us + after,
            channel: 0,
            rising,
        })
    })
}

#[test]
fn drifts_up_to_1000_ppm_come_out_with_a_third_of_the_trains_spoiled() {
    let (slope, place) = (Watch::new(&bounds::DRIFT), Watch::new(&bounds::OFFSET));
    for base_us in [
        4_200_000u64,
        (1 << 34) - 50_000_000,
        (1 << 53) - 50_000_001,
        (1 << 60) + 7,
    ] {
        for drift in DRIFTS {
            let sent = marks(400, 1_750_111_222);
            let mut random = Random(11);
            let mut edges = Vec::new();
            for (i, mark) in sent.iter().enumerate() {
                let host_us = mark.t.0 as f64 * 1e-3;
                let jitter = 2.0 * random.unit() - 1.0;
                let after = (host_us * (1.0 + drift * 1e-6) + jitter).round() as u64;
                let mut these: Vec<TriggerEdge> = train(mark.mark, base_us + after).collect();
                let k = (random.unit() * 48.0) as usize;
                match i % 6 {
                    // Eight pulses in a row: more than the code can correct.
                    1 => drop(these.drain(k..k + 16)),
                    3 => these.insert(k, these[k]),
                    _ => {}
                }
                edges.extend(these);
            }
            let found = fit_marks(&edges, 0, &sent).unwrap();
            let at = format!("from {base_us} µs, {drift} ppm: {:?}", found.fit);
            assert_eq!(found.fit.n, 333, "{at}");
            assert!(
                found
                    .warnings
                    .iter()
                    .any(|w| matches!(w, WarningCause::MarksUnseen { .. })),
                "{at}"
            );
            // 333 marks of 0.6 µs rms jitter over 700 s.
            slope.record((found.fit.drift_ppm - drift).abs(), &at);
            for host_us in [5e6, 2e8, 7e8] {
                let exact = exact_camera(0.0, drift, host_us) + real(base_us as f64);
                let coarse = UNIT * 2.0 * base_us as f64;
                let error = precise::error(found.fit.camera_us(host_us), &exact);
                place.record((error - 2.0 * coarse).max(0.0), &at);
            }
        }
    }
}

#[test]
fn invalid_times_give_no_clock_and_a_reason() {
    let sent = marks(40, 1_750_111_222);
    for base_us in [1u64 << 62, (1 << 63) + 5, u64::MAX - 100_000_000] {
        let edges: Vec<TriggerEdge> = sent
            .iter()
            .flat_map(|m| train(m.mark, base_us + m.t.0 as u64 / 1000))
            .collect();
        let refused = fit_marks(&edges, 0, &sent).unwrap_err();
        let MarksError::BrokenTimeBase { t_us } = refused else {
            panic!("expected a broken time base, found {refused}")
        };
        assert!(t_us >= 1 << 62, "{t_us}");
        let (mut input, mut source) = session();
        let mut count = 0;
        for k in 0..2 {
            let first = source.events[k].iter().map(|e| e.t_us).min().unwrap();
            for event in &mut source.events[k] {
                event.t_us = event.t_us - first + base_us;
            }
            for edge in &mut input.edges[k] {
                edge.t_us = (edge.t_us - first).saturating_add(base_us);
            }
            count += source.events[k].len();
        }
        assert!(count > 0);
        let a = analyze(&input, &source).unwrap();
        let is_broken = |w: &Warning| {
            matches!(
                w.cause,
                WarningCause::NoRatesClock {
                    why: RatesError::BrokenTimeBase { .. }
                }
            )
        };
        assert!(a.warnings.iter().any(is_broken), "{:?}", a.warnings);
        assert_eq!(a.clocks, [None, None]);
        assert_eq!((a.counts.valid, a.counts.invalid), (0, 50));
    }
}

/// Sessions whose camera clock passes the 34-bit wrap, encoded as camera bytes.
#[test]
fn a_session_over_the_wrap_of_34_bits_is_the_session_without_it() {
    let (mut input, mut source) = session();
    for k in 0..2 {
        let first = source.events[k].iter().map(|e| e.t_us).min().unwrap();
        // The wrap is in the middle of a press.
        let shift = |t: u64| t + (1 << 34) - first - 43_000_000;
        for event in &mut source.events[k] {
            event.t_us = shift(event.t_us);
        }
        source.events[k].sort_by_key(|e| e.t_us);
        for edge in &mut input.edges[k] {
            edge.t_us = shift(edge.t_us);
        }
    }
    let expected = analyze(&input, &source).unwrap();
    let mut decoded = Memory {
        events: [Vec::new(), Vec::new()],
        slice: 999,
    };
    for k in 0..2 {
        let events = &source.events[k];
        let mut encoder = Encoder::with_cadence(events[0].t_us, 64).unwrap();
        let mut bytes = Vec::new();
        for event in events {
            encoder.cd(*event, &mut bytes).unwrap();
        }
        let mut decoder = Decoder::new(StreamFormat::Evt2);
        for part in bytes.chunks(65_537) {
            decoder.push_cd(part, &mut decoded.events[k], &mut Vec::new());
        }
        assert_eq!(decoder.stats().wraps, 1);
        assert!(decoded.events[k].iter().any(|e| e.t_us > 1 << 34));
        assert_eq!(&decoded.events[k], events);
    }
    assert_eq!(analyze(&input, &decoded).unwrap(), expected);
    assert_eq!(expected.counts.valid, 50);
}

#[test]
fn disorder_within_ten_milliseconds_changes_nothing() {
    let (input, source) = session();
    let expected = analyze(&input, &source).unwrap();
    let mut shuffled = Memory {
        events: source.events.clone(),
        slice: 1000,
    };
    let mut moved = 0;
    for events in &mut shuffled.events {
        events.sort_by_key(|e| e.t_us);
        // Reverse every stretch of 9 ms.
        for stretch in events.chunk_by_mut(|a, b| a.t_us / 9_000 == b.t_us / 9_000) {
            moved += stretch.len() / 2;
            stretch.reverse();
        }
    }
    assert!(moved > 10_000);
    let found = analyze(&input, &shuffled).unwrap();
    assert_eq!(found.presses, expected.presses);
    assert_eq!(found.scored, expected.scored);
    assert_eq!(found.warnings, expected.warnings);
}

/// Presses at irregular intervals, and the counts of a camera with this clock in 10 ms bins.
fn pressed(count: u32, offset_us: f64, drift_ppm: f64) -> (Vec<PressSpan>, RateHistogram) {
    let mut random = Random(5);
    let mut rates = RateHistogram::new(10_000);
    let mut presses = Vec::new();
    let mut t = 4e6;
    for _ in 0..count {
        presses.push(PressSpan {
            contact_us: t,
            release_us: t + 5e5,
            sync: false,
        });
        t += 1.6e6 + 4e5 * random.unit();
    }
    let fit = clock(offset_us, drift_ppm);
    for bin in 0..((fit.camera_us(t) + 4e6) * 1e-4) as u64 {
        let noise = (3.0 * random.unit()) as u64;
        (0..noise).for_each(|_| rates.add(bin * 10_000));
    }
    for press in &presses {
        for _ in 0..600 {
            let after = if random.unit() < 0.6 {
                1e5 * random.unit()
            } else {
                3.5e5 + 1.5e5 * random.unit()
            };
            rates.add(fit.camera_us(press.contact_us + after) as u64);
        }
    }
    (presses, rates)
}

#[test]
fn drifts_up_to_1000_ppm_are_found_in_the_rates_or_doubted() {
    let (slope, place) = (
        Watch::new(&bounds::RATES_DRIFT),
        Watch::new(&bounds::RATES_OFFSET),
    );
    let (mut right, mut doubted) = (0, 0);
    for drift in [0.0, 50.0, -200.0, 300.0, -600.0, 1000.0, -1000.0] {
        for count in [60, 400, 2000] {
            let (presses, rates) = pressed(count, 31e6, drift);
            let found = fit_rates(&rates, &presses);
            let at = format!("{drift} ppm, {count} presses: {found:?}");
            let Ok((found, evidence)) = found else {
                doubted += 1;
                continue;
            };
            if !found.warnings.is_empty() {
                doubted += 1;
                continue;
            }
            right += 1;
            let error_ppm = (found.fit.drift_ppm - drift).abs();
            slope.record(error_ppm / found.fit.drift_se_ppm, &at);
            for press in [0, presses.len() / 2, presses.len() - 1] {
                let host_us = presses[press].contact_us;
                let error = found.fit.camera_us(host_us) - clock(31e6, drift).camera_us(host_us);
                place.record(error.abs() * 1e-3, &at);
            }
            assert!(drift.abs() <= 1000.0 && evidence.log_odds > 7.0, "{at}");
        }
    }
    assert!(right >= 17, "{right} right, {doubted} doubted");
}
