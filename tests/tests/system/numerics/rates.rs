//! Background rates from zero to fifty million events per second, and simultaneous presses.

use skinrig_analysis::rule::Rule;
use skinrig_analysis::{Analysis, EventSource, EventSourceError, SessionInput, analyze};
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraId, CdEvent, HostTime, MarkKind, Point2, Polarity,
    PressRole, PressTiming, RigGeometry, SkinOutline, StereoGeometry,
};
use skinrig_planted::{PlantedPress, mark, press};

use crate::numerics::bounds::{self, UNIT, Watch};

/// A press every 0.1 s, 20 ms long: with 5 ms on both sides the window is 30 ms, and 70 ms are idle.
const PERIOD_US: u64 = 100_000;
const PRESS_US: u64 = 20_000;
const SIDE_US: u64 = 5_000;
const PRESSES: u64 = 4;
const FIRST_US: u64 = 100_000;

/// Events as a function of time: `background` on every microsecond, and `extra[press]` at one instant of each press.
struct SyntheticEvents {
    background: u64,
    extra: [u64; PRESSES as usize],
}

impl EventSource for SyntheticEvents {
    fn for_each_slice(
        &self,
        _: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        let event = |t_us, i: u64| CdEvent {
            t_us,
            x: 300 + (i % 40) as u16,
            y: 250 + (i / 40 % 20) as u16,
            polarity: Polarity::from_bit(i.is_multiple_of(2)),
        };
        let mut slice: Vec<CdEvent> = Vec::new();
        for t in 0..FIRST_US + PRESSES * PERIOD_US {
            slice.extend((0..self.background).map(|i| event(t, i + 50 * t)));
            let middle = t.wrapping_sub(FIRST_US + PRESS_US / 2);
            if middle.is_multiple_of(PERIOD_US)
                && let Some(extra) = self.extra.get((middle / PERIOD_US) as usize)
            {
                for from in (0..*extra).step_by(8192) {
                    each(&slice);
                    slice.clear();
                    slice.extend((from..(from + 8192).min(*extra)).map(|i| event(t, i)));
                }
            }
            if slice.len() > 4096 {
                each(&slice);
                slice.clear();
            }
        }
        each(&slice);
        Ok(())
    }
}

fn session() -> SessionInput {
    let mut input = skinrig_planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings {
            calibration: CalibrationModel::None,
            window_before_ms: SIDE_US as f64 * 1e-3,
            window_after_ms: SIDE_US as f64 * 1e-3,
            exclude_outside: false,
            study_presses: 0,
            bootstrap_resamples: 10,
            ..AnalysisSettings::default()
        },
    );
    for k in 0..PRESSES {
        let begins_us = FIRST_US + k * PERIOD_US;
        let t = |us: u64| HostTime(((begins_us + us) * 1000) as i64);
        let touch = PlantedPress {
            timing: PressTiming {
                approach: t(0),
                contact: t(0),
                at_depth: t(1000),
                retract: t(PRESS_US - 1000),
                release: t(PRESS_US),
                clear: t(PRESS_US),
            },
            measured_depth_mm: None,
            ..PlantedPress::new(PressRole::Score, 0, k as u32, Point2::new(10.0, 2.0))
        };
        let id = press(&mut input, touch);
        mark(&mut input, (MarkKind::Contact, id), t(0), 0, |_| begins_us);
    }
    input
}

fn analysed(flood: &SyntheticEvents) -> Analysis {
    let a = analyze(&session(), flood).unwrap();
    crate::numerics::hostile::holds_only_numbers(&a);
    a
}

fn rule(a: &Analysis, press: usize) -> Option<Rule> {
    a.presses[press].rule()
}

#[test]
fn fifty_million_background_events_per_second_are_counted_and_predicted() {
    // 50 events per µs over a window of 30 ms: 1.5 million, and sqrt(1.5e6 (1 + 30 / 70)) = 1464 standard error.
    let error = (1.5e6f64 * (1.0 + 3.0 / 7.0)).sqrt();
    let (below, above) = ((4.9 * error) as u64, (5.1 * error) as u64);
    let a = analysed(&SyntheticEvents {
        background: 50,
        extra: [0, below, above, 1_000_000],
    });
    let rate = Watch::new(&bounds::RATE);
    for (k, extra) in [0, below, above, 1_000_000].into_iter().enumerate() {
        let view = a.presses[k].views[1].unwrap();
        assert_eq!(u64::from(view.events), 1_500_000 + extra);
        if k > 0 {
            let at = format!("{view:?}");
            rate.record((view.idle_rate_per_s - 5e7).abs() / 5e7 / UNIT, &at);
            let expected = (1_500_000 + extra) as f64 / 0.03;
            rate.record((view.rate_per_s - expected).abs() / expected / UNIT, &at);
        }
    }
    assert_eq!(rule(&a, 1), Some(Rule::NoResponse(CameraId::One)));
    assert_eq!((rule(&a, 2), rule(&a, 3)), (None, None));
    let peak = a.rates[0].peak_per_s.iter().copied().fold(0.0, f32::max);
    assert_eq!(peak, 1.5e8, "a million events more in one bin of 10 ms");
}

#[test]
fn without_background_and_without_events_everything_has_its_row() {
    let a = analysed(&SyntheticEvents {
        background: 0,
        extra: [0, 1, 30, 10_000_000],
    });
    for (k, events) in [0, 1, 30, 10_000_000].into_iter().enumerate() {
        let view = a.presses[k].views[0].unwrap();
        assert_eq!((view.events, view.idle_rate_per_s), (events, 0.0));
        assert_eq!(view.centroid_u.is_some(), events >= 10);
    }
    for k in [0, 1] {
        assert_eq!(rule(&a, k), Some(Rule::NoCluster(CameraId::One)));
    }
    assert_eq!((rule(&a, 2), rule(&a, 3)), (None, None));
    // Ten million simultaneous events on 800 pixels: the centroid is the middle of the block.
    assert_eq!(a.presses[3].views[0].unwrap().centroid_u, Some(319.5));

    let silent = analysed(&SyntheticEvents {
        background: 0,
        extra: [0; 4],
    });
    assert_eq!(silent.counts.excluded, 4);
    assert_eq!(silent.scored.rmse_mm.value, None);
}
