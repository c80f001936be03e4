//! Regions on many planted skins: coverage overall and by parts, and the cost of a choice.

use rayon::prelude::*;
use skinrig_model::Locator;

use super::skins::{Noise, Skin, Spreads, learn, rms, scored};

/// A skin whose kind depends on its number.
fn drawn(seed: u64) -> Skin {
    let mut noise = Noise::new(seed ^ 0xc0ffee);
    let plain = Skin::new(seed);
    Skin {
        side: 11 + (noise.unit() * 5.0) as u32,
        bend_px: [0.0, 5.0, 12.0, 20.0][(noise.unit() * 4.0) as usize],
        noise_px: [1.0, 3.0, 8.0][(noise.unit() * 3.0) as usize],
        outliers: [0.0, 0.0, 0.04][(noise.unit() * 3.0) as usize],
        weak: 0.2 + 0.6 * noise.unit(),
        depths: if noise.unit() < 0.5 {
            &[2.0]
        } else {
            &[1.0, 2.0, 3.0]
        },
        repeats: if noise.unit() < 0.5 { 1 } else { 3 },
        spreads: [
            Spreads::Absent,
            Spreads::Near(0.08),
            Spreads::Near(0.2),
            Spreads::Chance,
        ][(noise.unit() * 4.0) as usize],
        ..plain
    }
}

/// (Inside, all) of the valid presses: overall, by thirds of the skin, of the depth (by value) and of the response.
#[derive(Default, Clone)]
struct Tally(Vec<(&'static str, f64, f64)>);

impl Tally {
    fn add(&mut self, name: &'static str, inside: bool) {
        let at = self.0.iter().position(|r| r.0 == name);
        let at = at.unwrap_or_else(|| {
            self.0.push((name, 0.0, 0.0));
            self.0.len() - 1
        });
        self.0[at].1 += f64::from(u8::from(inside));
        self.0[at].2 += 1.0;
    }
}

fn of_skin(skin: &Skin, tally: &mut Tally) {
    let choice = learn(skin, Locator::Auto);
    for (press, error, location) in scored(skin, &choice) {
        let inside = location.region.is_some_and(|r| r.reach(error) <= 1.0);
        tally.add("all", inside);
        tally.add(choice.result.locator.name(), inside);
        let y = press.truth.unwrap().y_mm;
        tally.add(
            ["skin low", "skin middle", "skin high"][((y + 30.0) / 21.4) as usize],
            inside,
        );
        let events = super::skins::features(&press).cluster_events;
        let class = usize::from(events > 75) + usize::from(events > 125);
        tally.add(["weak", "usual", "strong"][class], inside);
        tally.add(
            ["1 mm", "2 mm", "3 mm"][press.depth_mm as usize - 1],
            inside,
        );
        let spreads = match skin.spreads {
            Spreads::Absent => "columns alone",
            Spreads::Near(_) => "spreads by distance",
            Spreads::Chance => "spreads by chance",
        };
        tally.add(spreads, inside);
    }
}

fn coverage(skins: u64) -> Tally {
    let parts: Vec<Tally> = (0..skins)
        .into_par_iter()
        .map(|seed| {
            let mut tally = Tally::default();
            of_skin(&drawn(seed), &mut tally);
            tally
        })
        .collect();
    let mut sum = Tally::default();
    for (name, inside, all) in parts.into_iter().flat_map(|t| t.0) {
        match sum.0.iter_mut().find(|r| r.0 == name) {
            Some(row) => (row.1, row.2) = (row.1 + inside, row.2 + all),
            None => sum.0.push((name, inside, all)),
        }
    }
    sum
}

/// Presses of one skin share its errors: parts of eight skins scatter by several percent.
#[test]
fn regions_hold_on_eight_skins() {
    for (name, inside, all) in coverage(8).0 {
        let share = inside / all;
        let allowed = if name == "all" {
            0.925..=0.985
        } else {
            0.88..=1.0
        };
        assert!(allowed.contains(&share), "{name}: {share} of {all}");
    }
}

/// Each of eight places calibrates once: the geometry fits a part of how the presses scatter, and what is left of it looks small.
#[test]
fn regions_hold_where_few_presses_calibrate() {
    for (bend_px, outliers) in [(5.0, 0.0), (12.0, 0.0), (5.0, 0.05), (12.0, 0.1)] {
        let skins = (0..200).into_par_iter().map(|seed| {
            let skin = Skin {
                side: 4,
                noise_px: 8.0,
                bend_px,
                outliers,
                ..Skin::new(seed)
            };
            let choice = learn(&skin, Locator::Geometry);
            let presses = scored(&skin, &choice).into_iter();
            let regions = presses.filter_map(|(_, error, l)| Some(l.region?.reach(error)));
            let reaches: Vec<f64> = regions.collect();
            let inside = reaches.iter().filter(|reach| **reach <= 1.0).count();
            (inside as f64, reaches.len() as f64)
        });
        let (inside, all) = skins.reduce(|| (0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        let share = inside / all;
        assert!(
            (0.945..=0.99).contains(&share),
            "bent by {bend_px} px, {outliers} far off: {share} of {all}"
        );
    }
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-analysis-tests locator -- --ignored"]
fn regions_hold_on_five_hundred_skins() {
    let rows = coverage(500).0;
    for (name, inside, all) in &rows {
        println!("{name}: {:.1} % of {all}", 100.0 * inside / all);
    }
    let holds = |(_, inside, all): &(&str, f64, f64)| (0.93..=0.98).contains(&(inside / all));
    assert!(rows.iter().all(holds), "(part, inside, presses): {rows:?}");
}

/// Few presses, one corner, ten times the noise, one camera nearly blind, one depth, and all of it bent or straight.
#[test]
#[ignore = "half a minute: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-analysis-tests locator -- --ignored"]
fn the_choice_is_never_much_worse_than_the_geometry_on_sixty_skins() {
    never_much_worse(60);
}

#[test]
fn the_choice_is_never_much_worse_than_the_geometry() {
    never_much_worse(10);
}

fn never_much_worse(skins: u64) {
    let mut rows = Vec::new();
    for i in 0..skins {
        let plain = Skin {
            bend_px: if i % 2 == 0 { 0.0 } else { 12.0 },
            ..Skin::new(100 + i)
        };
        let skin = match i / 2 % 5 {
            0 => Skin {
                calibrating: 14 + i as usize,
                ..plain
            },
            1 => Skin {
                corner: true,
                ..plain
            },
            2 => Skin {
                noise_px: 30.0,
                ..plain
            },
            3 => Skin {
                blind: 20.0,
                ..plain
            },
            _ => Skin {
                outliers: 0.1,
                ..plain
            },
        };
        rows.push((i, skin));
    }
    let rows: Vec<(u64, Locator, f64, f64)> = rows
        .into_par_iter()
        .map(|(i, skin)| {
            let auto = learn(&skin, Locator::Auto);
            let geometry = learn(&skin, Locator::Geometry);
            (
                i,
                auto.result.locator,
                rms(&skin, &auto),
                rms(&skin, &geometry),
            )
        })
        .collect();
    for (i, locator, with, without) in rows {
        assert!(
            with <= 1.05 * without,
            "{i}: {locator:?} {with} mm, {without} mm"
        );
    }
}
