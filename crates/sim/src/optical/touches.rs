//! The dents in the skin during one step, and the light that reaches a pixel past them.
//!
//! Each tip has one dent. One that its tip has left keeps relaxing while the tip makes another elsewhere. Light on its
//! way to the camera passes the dents one after the other: transmissions multiply, so that losses add up in the
//! exponent, and a dent dims what the flanks behind it return.

use std::ops::Range;

use skinrig_model::{Point2, SENSOR_WIDTH};

use super::column::{BlockLight, LANES, greater, sensitivity};
use super::contact::{Contact, Relaxation};
use super::dent::Dent;
use super::light::Vec2;
use super::optics::Optics;
use super::variation::Variation;

const WIDTH: usize = SENSOR_WIDTH as usize;

/// A column is evaluated when the optical depth of a dent has changed by so much, at the latest.
const MOST_DEPTH: f64 = 0.1;
/// Until then a dent of optical depth `z` loses or regains at most `exp(-z)` times this much light per unit: `exp(MOST_DEPTH)`,
/// rounded up.
const CURVATURE: f64 = 1.106;

/// One dent.
#[derive(Debug, Clone)]
struct Touch {
    /// Position of the tip at first touch.
    place: Vec2,
    variation: Variation,
    contact: Contact,
    dent: Dent,
    /// Depth at which each column was last evaluated, mm.
    evaluated_mm: Vec<f32>,
    /// Most light that each column loses or regains per mm until its next evaluation.
    lost_per_mm: Vec<f32>,
}

impl Touch {
    fn new(optics: &Optics, place: Vec2, variation: Variation) -> Self {
        let [dx, dy] = variation.offset_mm;
        let dent = Dent::new(optics, [place[0] + dx, place[1] + dy]);
        let lost = |k: &f64| (CURVATURE * k) as f32;
        Self {
            place,
            variation,
            contact: Contact::default(),
            lost_per_mm: dent.loss_per_mm.iter().map(lost).collect(),
            dent,
            evaluated_mm: vec![0.0; WIDTH],
        }
    }

    fn is_elsewhere(&self, at: Vec2, same_place_mm: f64) -> bool {
        let [dx, dy] = [at[0] - self.place[0], at[1] - self.place[1]];
        dx * dx + dy * dy > same_place_mm * same_place_mm
    }
}

/// One dent in the view of a column, during a step.
#[derive(Debug, Clone, Copy)]
struct Sight {
    /// Which of the touches.
    touch: usize,
    /// Part of the light that comes from behind the dent, and what its flanks return.
    shadow: f64,
    shine: f64,
    /// Lost light after the step.
    lost: f64,
    /// The same before the step, once [`Touches::look_back`] is called.
    lost_before: f64,
}

/// All dents in the skin: those of the tips first, then those that relax.
#[derive(Debug, Clone)]
pub(super) struct Touches {
    all: Vec<Touch>,
    tips: usize,
    relaxation: Relaxation,
    /// Columns with a dent that began or slid in this step: what was known of their slack no longer holds.
    pub(super) disturbed: Vec<Range<usize>>,
    /// Dents in the view of the column that was looked at last, the farthest first.
    sights: Vec<Sight>,
}

impl Touches {
    pub(super) fn new(optics: &Optics, tips: usize) -> Self {
        let centre = optics.scene.outline.centre;
        let touch = Touch::new(optics, [centre.x_mm, centre.y_mm], Variation::NONE);
        Self {
            all: vec![touch; tips],
            tips,
            relaxation: Relaxation::new(&optics.config),
            disturbed: Vec::new(),
            sights: Vec::new(),
        }
    }

    /// Moves the tips to `[x, y, z]` mm during one grid step; those without a position are off the skin. A dent that its tip
    /// leaves for another place relaxes.
    pub(super) fn follow(&mut self, optics: &Optics, mut tips: impl Iterator<Item = [f64; 3]>) {
        self.disturbed.clear();
        let mut moved = false;
        for k in 0..self.tips {
            let tip = tips.next();
            let depth_mm = tip.map_or(0.0, |at| depth_mm(optics, at));
            if let Some([x, y, _]) = tip
                && depth_mm > 0.0
                && self.needs_dent(optics, k, [x, y])
            {
                self.place(optics, k, [x, y]);
                moved = true;
            }
            let touch = &mut self.all[k];
            let unseen = touch.contact.is_unseen();
            let dented_mm = touch.variation.depth * depth_mm;
            touch.contact.follow(
                dented_mm.min(optics.scene.skin_thickness_mm),
                self.relaxation,
            );
            if unseen && !touch.contact.is_unseen() {
                self.disturbed.push(touch.dent.columns.clone());
            }
        }
        for left in &mut self.all[self.tips..] {
            left.contact.follow(0.0, self.relaxation);
        }
        if moved {
            let mut at = 0..self.all.len();
            let tips = self.tips;
            self.all
                .retain(|t| at.next().is_some_and(|k| k < tips) || !t.contact.is_gone());
        }
    }

    /// Whether tip `k`, on the skin at `at`, makes or drags another dent than its last one.
    fn needs_dent(&self, optics: &Optics, k: usize, at: Vec2) -> bool {
        let touch = &self.all[k];
        touch.is_elsewhere(at, optics.config.same_place_mm)
            || (optics.config.parts.varies_presses() && !touch.contact.is_held())
    }

    /// Tip `k` is on the skin at another place, or again: a new touch, or the same one slides and takes its dent along.
    fn place(&mut self, optics: &Optics, k: usize, place: Vec2) {
        if self.all[k].contact.is_held() {
            let new = Touch::new(optics, place, self.all[k].variation);
            let touch = &mut self.all[k];
            self.disturbed
                .extend([touch.dent.columns.clone(), new.dent.columns.clone()]);
            (touch.place, touch.dent) = (place, new.dent);
            return;
        }
        let new = Touch::new(optics, place, Variation::draw(optics, place));
        let left = std::mem::replace(&mut self.all[k], new);
        if !left.contact.is_gone() {
            self.all.push(left);
        }
    }

    /// Whether no dent changed during the step.
    pub(super) fn rest(&self) -> bool {
        let still = |t: &Touch| t.contact.seen_mm[0] == t.contact.seen_mm[1];
        self.disturbed.is_empty() && self.all.iter().all(still)
    }

    /// At least the largest change of a column's lost light during the step, all dents together.
    pub(super) fn largest_change(&self) -> f32 {
        let of = |t: &Touch| {
            let [from_mm, to_mm] = t.contact.seen_mm;
            (to_mm - from_mm).abs() * t.dent.largest_loss_per_mm
        };
        (CURVATURE * self.all.iter().map(of).sum::<f64>()) as f32
    }

    /// Columns that a dent can change, widened to whole blocks of [`LANES`].
    pub(super) fn columns(&self) -> Range<usize> {
        let seen = self.all.iter().filter(|t| !t.contact.is_unseen());
        let columns = seen.map(|t| &t.dent.columns).filter(|c| !c.is_empty());
        let (first, end) = columns.fold((WIDTH, 0), |(first, end), c| {
            (c.start.min(first), c.end.max(end))
        });
        first.min(end) / LANES * LANES..end.next_multiple_of(LANES)
    }

    /// At least the change of each column's lost light since its last evaluation, all dents together.
    pub(super) fn changes(&self, out: &mut [f32; WIDTH]) {
        out.fill(0.0);
        for touch in &self.all {
            let to_mm = touch.contact.seen_mm[1] as f32;
            let columns = touch.dent.columns.clone();
            for ((sum, mm), k) in out[columns.clone()]
                .iter_mut()
                .zip(&touch.evaluated_mm[columns.clone()])
                .zip(&touch.lost_per_mm[columns])
            {
                *sum += (to_mm - mm).abs() * k;
            }
        }
    }

    /// The same of one column.
    pub(super) fn change(&self, u: usize) -> f32 {
        let of = |t: &Touch| {
            let to_mm = t.contact.seen_mm[1] as f32;
            (to_mm - t.evaluated_mm[u]).abs() * t.lost_per_mm[u]
        };
        self.all.iter().map(of).sum()
    }

    /// Looks along column `u`: the next calls are about it, after the step until [`Self::look_back`] is called.
    pub(super) fn look(&mut self, u: usize) {
        self.sights.clear();
        for (touch, t) in self.all.iter().enumerate() {
            if t.dent.loss_per_mm[u] > 0.0 && !t.contact.is_unseen() {
                self.sights.push(Sight {
                    touch,
                    shadow: t.dent.shadow[u],
                    shine: t.dent.shine[u],
                    lost: t.dent.lost(u, t.contact.seen_mm[1]),
                    lost_before: f64::NAN,
                });
            }
        }
        // The farther the dent, the less light comes from behind it.
        self.sights
            .sort_unstable_by(|a, b| a.shadow.total_cmp(&b.shadow).then(a.touch.cmp(&b.touch)));
    }

    /// Looks at column `u`, which is looked along, before the step too.
    pub(super) fn look_back(&mut self, u: usize) {
        for sight in &mut self.sights {
            let touch = &self.all[sight.touch];
            sight.lost_before = touch.dent.lost(u, touch.contact.seen_mm[0]);
        }
    }

    /// Each dent in the view of the column, the farthest first, with the light that joins in front of it.
    #[inline(always)]
    fn views(&self) -> impl Iterator<Item = (&Sight, &Dent, f64)> {
        let nearer = self.sights.iter().skip(1).map(|s| s.shadow).chain([1.0]);
        self.sights
            .iter()
            .zip(nearer)
            .map(|(sight, beyond)| (sight, &self.all[sight.touch].dent, beyond - sight.shadow))
    }

    /// Light of the column that comes from behind all dents.
    fn farthest(&self) -> f64 {
        self.sights.first().map_or(1.0, |s| s.shadow)
    }

    /// Light of the skin's row `v` before and after the step, for a column that was looked back at; 1 without dents.
    pub(super) fn light(&self, v: usize) -> [f64; 2] {
        let mut light = [self.farthest(); 2];
        for (sight, dent, joins) in self.views() {
            let shadow = f64::from(dent.shadow_rows[v]);
            let shine = sight.shine * f64::from(dent.shine_rows[v]);
            for (light, lost) in light.iter_mut().zip([sight.lost_before, sight.lost]) {
                *light += lost * (shine - shadow * *light) + joins;
            }
        }
        light
    }

    /// The most that the light of the skin's row `v` changes per unit of lost light.
    pub(super) fn most(&self, v: usize) -> f32 {
        let (mut most, mut behind) = (0.0, 0.0);
        for (n, (sight, dent, _)) in self.views().enumerate() {
            let returned = sight.shine as f32 * dent.shine_rows[v];
            let dimmed = dent.shadow_rows[v] * (sight.shadow as f32 + behind);
            most = greater(most, sensitivity(n == 0, returned, dimmed));
            behind += returned;
        }
        most
    }

    /// Looks along column `u`, which counts as evaluated. Returns the change of its lost light at which that must happen again.
    pub(super) fn evaluate(&mut self, u: usize) -> f32 {
        self.look(u);
        for touch in &mut self.all {
            touch.evaluated_mm[u] = touch.contact.seen_mm[1] as f32;
            touch.lost_per_mm[u] = (CURVATURE * touch.dent.loss_per_mm[u]) as f32;
        }
        let mut least = 1.0;
        for sight in &self.sights {
            let left = 1.0 - sight.lost;
            least = left.min(least);
            self.all[sight.touch].lost_per_mm[u] *= left as f32;
        }
        (CURVATURE * MOST_DEPTH * least) as f32
    }

    /// Light of one of the column's blocks of rows after the step.
    #[inline(always)]
    pub(super) fn block(&self, block: usize) -> BlockLight {
        let mut light = BlockLight::new(self.farthest() as f32);
        for (n, (sight, dent, joins)) in self.views().enumerate() {
            let [shadow_rows, shine_rows] = [&dent.shadow_rows, &dent.shine_rows]
                .map(|rows| &rows.as_chunks::<LANES>().0[block]);
            let constants = [sight.lost, sight.shadow, sight.shine, joins];
            light.pass(shadow_rows, shine_rows, n == 0, constants.map(|x| x as f32));
        }
        light
    }
}

/// Depth of a tip at `[x, y, z]` mm.
fn depth_mm(optics: &Optics, [x, y, z]: [f64; 3]) -> f64 {
    if z < 0.0 && optics.scene.outline.contains(Point2::new(x, y)) {
        // The base is rigid: the depth is limited to the skin's thickness.
        (-z).min(optics.scene.skin_thickness_mm)
    } else {
        0.0
    }
}
