//! Several tips on one skin: their dents act together on each pixel.
//!
//! Light on its way to the camera passes the dents one after the other: transmissions multiply, so that losses add up in the
//! exponent, and a dent dims what the flanks behind it return. The light of a pixel then has no single monotone
//! parameter; every pixel that a dent reaches is evaluated in each step in which its light may pass a threshold.

use std::ops::Range;

use skinrig_model::{Point3, SENSOR_WIDTH, Skin};

use super::config::OpticalConfig;
use super::contact::Contact;
use super::dent::Dent;
use super::light::{Column, Illumination};
use super::noise::Noise;
use super::pixels::{Change, Pixels, Ramp};
use super::untouched::Untouched;
use crate::scene::{FurtherTip, GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};

const WIDTH: usize = SENSOR_WIDTH as usize;

/// One tip's dent during a step.
#[derive(Debug, Clone)]
struct Touch {
    contact: Contact,
    dent: Dent,
    ramp: Ramp,
}

/// One dent in the view of a column, during a step.
#[derive(Debug, Clone, Copy)]
struct Sight<'a> {
    dent: &'a Dent,
    /// Part of the light that comes from behind the dent, and what its flanks return.
    shadow: f64,
    shine: f64,
    /// Lost light before and after the step.
    lost: [f64; 2],
}

/// The dents in the view of one column, the nearest first.
#[derive(Debug, Clone, Default)]
struct Sights<'a>(Vec<Sight<'a>>);

impl<'a> Sights<'a> {
    fn look(&mut self, touches: &'a [Touch], u: usize) {
        self.0.clear();
        self.0.extend(touches.iter().map(|t| Sight {
            dent: &t.dent,
            shadow: t.dent.shadow[u],
            shine: t.dent.shine[u],
            lost: [t.ramp.from_mm, t.ramp.to_mm].map(|mm| t.dent.lost(u, mm)),
        }));
        // The nearer the dent, the more light comes from behind it.
        self.0.sort_by(|a, b| b.shadow.total_cmp(&a.shadow));
    }

    /// Light in row `v` before (0) or after (1) the step; 1 without dents.
    fn light(&self, v: usize, end: usize) -> f64 {
        let (mut light, mut passed, mut beyond) = (0.0, 1.0, 1.0);
        for sight in &self.0 {
            let lost = sight.lost[end];
            let returned = sight.shine * lost * sight.dent.shine_rows[v];
            light += (beyond - sight.shadow + returned) * passed;
            passed *= 1.0 - lost * sight.dent.shadow_rows[v];
            beyond = sight.shadow;
        }
        light + beyond * passed
    }

    fn change(&self, v: usize, t_ns: i64) -> Change {
        Change {
            t_ns,
            from: self.light(v, 0) - 1.0,
            to: self.light(v, 1) - 1.0,
        }
    }
}

/// Pixels of one camera over an optically modelled skin that several tips touch.
#[derive(Debug, Clone)]
pub struct SeveralTips {
    scene: SceneConfig,
    config: OpticalConfig,
    light: Illumination,
    columns: Vec<Column>,
    pixels: Pixels,
    noise: Noise,
    touches: Vec<Touch>,
    further: Vec<FurtherTip>,
    creep_step: f64,
    /// Per column: least change of light that causes an event since its last evaluation.
    slack: Vec<f64>,
    /// Per column and tip: depth at that time, mm.
    evaluated: Vec<f64>,
    first_ns: i64,
    last: Option<(i64, Vec<Point3<Skin>>)>,
}

impl SeveralTips {
    /// The model for a first tip and `further` ones that move with it.
    #[must_use]
    pub fn new(scene: &SceneConfig, config: OpticalConfig, further: &[FurtherTip]) -> Self {
        let Untouched {
            light,
            columns,
            noise,
            mut pixels,
            contact,
            dent,
        } = Untouched::new(scene, &config);
        let touch = Touch {
            contact,
            dent,
            ramp: Ramp {
                t_ns: 0,
                from_mm: 0.0,
                to_mm: 0.0,
            },
        };
        pixels.start_by_light();
        let tips = 1 + further.len();
        Self {
            scene: scene.clone(),
            config,
            light,
            columns,
            pixels,
            noise,
            touches: vec![touch; tips],
            further: further.to_vec(),
            creep_step: Contact::creep_step(&config),
            slack: vec![f64::NEG_INFINITY; WIDTH],
            evaluated: vec![0.0; WIDTH * tips],
            first_ns: 0,
            last: None,
        }
    }

    /// Moves each tip on a straight line to its position at `t_ns`, on the grid, and appends the events until then. The first
    /// call only places them. Tips without a position stay.
    pub fn advance_to(&mut self, t_ns: i64, tips: &[Point3<Skin>], out: &mut Vec<PixelEvent>) {
        let Some((last_ns, from)) = self.last.take() else {
            self.first_ns = t_ns;
            self.last = Some((t_ns, tips.to_vec()));
            return;
        };
        let steps = (t_ns - last_ns) / GRID_NS;
        let mut positions = vec![[0.0; 3]; tips.len()];
        for k in 0..steps {
            let part = (k + 1) as f64 / steps as f64;
            for ((at, a), b) in positions.iter_mut().zip(&from).zip(tips) {
                let (a, b) = (a.to_array(), b.to_array());
                *at = [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * part);
            }
            self.step(last_ns + k * GRID_NS, &positions, out);
        }
        self.last = Some((t_ns, tips.to_vec()));
    }

    fn step(&mut self, t_ns: i64, tips: &[[f64; 3]], out: &mut Vec<PixelEvent>) {
        let begin = out.len();
        let replaced = self.indent(t_ns, tips);
        self.pixels_step(t_ns, &replaced, out);
        self.noise
            .step(t_ns, t_ns - self.first_ns, &mut self.pixels, out);
        out[begin..].sort_unstable_by_key(|e| (e.t_ns, e.y, e.x, e.polarity.bit()));
    }

    /// Moves the tips; returns the columns of dents that are gone.
    fn indent(&mut self, t_ns: i64, tips: &[[f64; 3]]) -> Vec<Range<usize>> {
        let mut replaced = Vec::new();
        for (touch, tip) in self.touches.iter_mut().zip(tips) {
            let (ramp, moved) =
                touch
                    .contact
                    .indent(&self.scene, &self.config, self.creep_step, t_ns, *tip);
            touch.ramp = ramp;
            if moved {
                replaced.push(touch.dent.own_columns.clone());
                touch.dent = Dent::new(
                    &self.scene,
                    &self.config,
                    &self.light,
                    &self.columns,
                    touch.contact.place,
                    None,
                );
                replaced.push(touch.dent.own_columns.clone());
            }
        }
        replaced
    }

    fn pixels_step(&mut self, t_ns: i64, replaced: &[Range<usize>], out: &mut Vec<PixelEvent>) {
        for u in self.pixels.held_columns() {
            self.slack[u] = f64::NEG_INFINITY;
        }
        let touches = &self.touches;
        let see = |u: usize, v: usize| {
            let mut sights = Sights::default();
            sights.look(touches, u);
            (sights.change(v, t_ns), 1.0)
        };
        self.pixels.release(t_ns, see, |_, x| x, out);
        let still = touches.iter().all(|t| t.ramp.from_mm == t.ramp.to_mm);
        if still && replaced.is_empty() {
            return;
        }
        for u in replaced.iter().cloned().flatten() {
            self.slack[u] = f64::NEG_INFINITY;
        }
        let own = |t: &Touch| t.dent.own_columns.clone();
        let first = touches.iter().map(|t| own(t).start).min().unwrap_or(0);
        let end = touches.iter().map(|t| own(t).end).max().unwrap_or(0);
        let all = replaced
            .iter()
            .fold(first..end, |a, b| a.start.min(b.start)..a.end.max(b.end));
        let mut sights = Sights::default();
        for u in all {
            let evaluated = &mut self.evaluated[u * touches.len()..][..touches.len()];
            // No light changes faster than its loss at depth 0.
            let part = |(t, mm): (&Touch, &f64)| (t.ramp.to_mm - mm).abs() * t.dent.loss_per_mm[u];
            let moved: f64 = touches.iter().zip(&*evaluated).map(part).sum();
            let most: f64 = touches
                .iter()
                .map(|t| t.dent.shadow[u] + t.dent.shine[u])
                .sum();
            if moved * most < self.slack[u] {
                continue;
            }
            for (mm, t) in evaluated.iter_mut().zip(touches) {
                *mm = t.ramp.to_mm;
            }
            sights.look(touches, u);
            self.slack[u] = evaluate(&mut self.pixels, &sights, u, t_ns, out);
        }
    }
}

/// Emits the events of one column in the step from `t_ns`; returns the least change of light that causes the next one.
fn evaluate(
    pixels: &mut Pixels,
    sights: &Sights<'_>,
    u: usize,
    t_ns: i64,
    out: &mut Vec<PixelEvent>,
) -> f64 {
    let mut least = f64::INFINITY;
    for v in pixels.skin_rows() {
        let to = sights.light(v, 1) - 1.0;
        if pixels.slack(u, v, to) < 0.0 {
            pixels.emit((u, v), 1.0, sights.change(v, t_ns), 0, out);
        }
        least = least.min(pixels.slack(u, v, to));
    }
    least
}

impl PixelModel for SeveralTips {
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>) {
        let mut positions = Vec::with_capacity(1 + self.further.len());
        for tip in tips {
            positions.clear();
            positions.push(tip.position);
            positions.extend(self.further.iter().map(|f| f.position(tip.position)));
            self.advance_to(tip.t_ns, &positions, out);
        }
    }
}
