//! The geometric level: Poisson events around the projected column of the contact, with rates fitted to figures of the published
//! recording. No optics; the only localisation error is sampling noise.

use skinrig_model::{Point2, Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::columns::ColumnTable;
use crate::random::{Purpose, Stream};
use crate::scene::{GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};

/// Event rates and spreads of a camera.
///
/// Sources: dataset.md section 5 gives 28.6 kev/s for both cameras together during a press of 0.55 s, and 9.1 kev/s between presses. The
/// dependence on distance, the polarity shares and the decay are fitted to the synthetic sample recordings in the published layout.
#[derive(Debug, Clone, PartialEq)]
pub struct GeometricConfig {
    /// Events per mm of the tip's downward travel in the skin, at `reference_mm`.
    pub press_per_mm: f64,
    /// Events per mm of the tip's upward travel in the skin, at `reference_mm`.
    pub release_per_mm: f64,
    /// Events of the slow relaxation per mm of travel in either direction, at `reference_mm`.
    pub relax_per_mm: f64,
    /// Time constant of the relaxation, s.
    pub relax_s: f64,
    /// Share of OFF events while pressing, and of ON events while releasing.
    pub polarity_share: f64,
    /// Distance from the camera at which these rates hold, mm.
    pub reference_mm: f64,
    /// Rates are proportional to `1 / (distance + fall_off_mm)`.
    pub fall_off_mm: f64,
    /// Standard deviation of the soft halo around the tip's footprint at 2 mm depth, mm; proportional to the square root of the depth.
    pub halo_mm: f64,
    /// Standard deviation along the rows as a share of the height of the visible skin.
    pub row_share: f64,
    /// Background events per second over the whole sensor, without hot pixels.
    pub background_hz: f64,
    /// Number of hot pixels.
    pub hot_pixels: usize,
    /// Event rate of the hottest pixel, events per second; the k-th has 1/k of it.
    pub hottest_hz: f64,
    /// Probability that a contact produces no events in a camera (the public code removes 11 of 250 presses by hand; the paper: no prominent
    /// cluster).
    pub dead_share: f64,
    /// Half width of the uniform variation of a contact's strength around 1.
    pub strength_spread: f64,
    /// Contacts, counted from 0 over all locations, without events (fault injection).
    pub dead_contacts: Vec<u32>,
}

impl Default for GeometricConfig {
    fn default() -> Self {
        Self {
            press_per_mm: 1_550.0,
            release_per_mm: 1_300.0,
            relax_per_mm: 1_550.0,
            relax_s: 1.2,
            polarity_share: 0.76,
            reference_mm: 55.0,
            fall_off_mm: 53.0,
            halo_mm: 3.0,
            row_share: 0.1,
            background_hz: 1_800.0,
            hot_pixels: 6,
            hottest_hz: 250.0,
            dead_share: 0.02,
            strength_spread: 0.15,
            dead_contacts: Vec::new(),
        }
    }
}

impl GeometricConfig {
    /// The same camera with the lamps off (assumption): presses produce no events, and a third of the background remains, about the share of
    /// leakage in the noise of the optical level. Hot pixels remain.
    #[must_use]
    pub fn dark(&self) -> Self {
        Self {
            press_per_mm: 0.0,
            release_per_mm: 0.0,
            relax_per_mm: 0.0,
            background_hz: self.background_hz / 3.0,
            ..self.clone()
        }
    }
}

/// A pressed location that is still relaxing.
#[derive(Debug, Clone)]
struct RelaxingContact {
    at: Point2,
    /// Columns of the footprint's points.
    columns: Vec<f64>,
    /// Standard deviation of the halo, columns at 2 mm depth.
    halo_px: f64,
    /// Rate factor: distance, strength, and whether the contact is dead.
    gain: f64,
    /// Expected events left in the relaxation.
    left: f64,
}

/// The pixel model of the geometric level.
#[derive(Debug, Clone)]
pub struct GeometricModel {
    config: GeometricConfig,
    scene: SceneConfig,
    table: ColumnTable,
    events: Stream,
    hot: Vec<(u16, u16)>,
    hot_hz: f64,
    sites: Vec<RelaxingContact>,
    touching: bool,
    /// Expected events until the next one.
    due: f64,
    last: Option<TipSample>,
    decay: f64,
}

/// Origin of an event.
#[derive(Clone, Copy)]
enum Source {
    Background,
    Hot,
    /// The newest site, at this depth, with this share of ON events.
    Motion {
        depth_mm: f64,
        on_share: f64,
    },
    Relaxing(usize),
}

/// A site with fewer expected events is removed.
const NEGLIGIBLE: f64 = 0.5;

impl GeometricModel {
    /// Model of one camera.
    #[must_use]
    pub fn new(scene: &SceneConfig, config: &GeometricConfig) -> Self {
        let mut pixels = Stream::new(scene.seed, Purpose::Pixels, 1);
        let mut events = Stream::new(scene.seed_of_start(), Purpose::Pixels, 2);
        let hot = (0..config.hot_pixels)
            .map(|_| {
                let x = pixels.between(0.0, f64::from(SENSOR_WIDTH)) as u16;
                let y = pixels.between(0.0, f64::from(SENSOR_HEIGHT)) as u16;
                (x, y)
            })
            .collect();
        let hot_hz = (1..=config.hot_pixels)
            .map(|k| config.hottest_hz / k as f64)
            .sum();
        Self {
            table: ColumnTable::new(scene.camera),
            scene: scene.clone(),
            due: events.exponential(),
            events,
            hot,
            hot_hz,
            sites: Vec::new(),
            touching: false,
            last: None,
            decay: libm::exp(-(GRID_NS as f64 * 1e-9) / config.relax_s),
            config: config.clone(),
        }
    }

    fn begin_contact(&mut self, at: Point2) {
        let c = &self.config;
        let contact = self.scene.contacts.next(at);
        let mut drawn = contact.random(self.scene.seed);
        let dead = drawn.unit() < c.dead_share || c.dead_contacts.contains(&contact.number);
        let strength = 1.0 + drawn.between(-c.strength_spread, c.strength_spread);
        let distance = self.scene.camera.position.distance_mm(at);
        let falloff = (c.reference_mm + c.fall_off_mm) / (distance + c.fall_off_mm);
        let visible = self.table.column(at).is_some() && self.scene.outline.contains(at);
        let gain = if dead || !visible {
            0.0
        } else {
            strength * falloff
        };
        let columns = self.table.footprint(at, self.scene.tip_side_mm);
        let halo_px = c.halo_mm * self.table.columns_per_mm(at);
        self.sites.push(RelaxingContact {
            at,
            columns,
            halo_px,
            gain,
            left: 0.0,
        });
    }

    /// Simulates one grid step from `a` to `b`.
    fn step(&mut self, a: TipSample, b: TipSample, out: &mut Vec<PixelEvent>) {
        let dt_s = (b.t_ns - a.t_ns) as f64 * 1e-9;
        let (from, to) = ((-a.position.z_mm).max(0.0), (-b.position.z_mm).max(0.0));
        if b.position.z_mm < 0.0 {
            let at = b.position.plane();
            // A tip that slides along the skin (no protocol does that) leaves a row of sites 1 mm apart.
            let slid = self
                .sites
                .last()
                .is_some_and(|s| s.at.distance_mm(at) > 1.0);
            if !self.touching || slid {
                self.begin_contact(at);
            }
            self.touching = true;
        } else if b.position.z_mm > 0.05 {
            self.touching = false;
        }
        let c = &self.config;
        let travel = to - from;
        let gain = self.sites.last().map_or(0.0, |s| s.gain);
        let moving = gain
            * if travel > 0.0 {
                travel * c.press_per_mm
            } else {
                -travel * c.release_per_mm
            };
        let background = c.background_hz * dt_s;
        let hot = self.hot_hz * dt_s;
        let relaxing = 1.0 - self.decay;
        let slow: f64 = self.sites.iter().map(|s| s.left * relaxing).sum();
        let total = background + hot + moving + slow;
        let mut passed = self.due;
        while passed < total {
            let share = passed / total;
            let t_ns = a.t_ns + ((b.t_ns - a.t_ns) as f64 * share) as i64;
            let source = self.source(
                background,
                hot,
                moving,
                travel,
                from + travel * share,
                total,
            );
            if let Some(event) = self.emit(t_ns, source) {
                out.push(event);
            }
            passed += self.events.exponential();
        }
        self.due = passed - total;
        for site in &mut self.sites {
            site.left *= self.decay;
        }
        if let Some(site) = self.sites.last_mut() {
            site.left += site.gain * travel.abs() * self.config.relax_per_mm;
        }
        let newest = self.sites.len().saturating_sub(1);
        let mut k = 0;
        self.sites.retain(|s| {
            k += 1;
            s.left > NEGLIGIBLE || k > newest
        });
    }

    fn source(
        &mut self,
        background: f64,
        hot: f64,
        moving: f64,
        travel: f64,
        depth_mm: f64,
        total: f64,
    ) -> Source {
        let mut pick = self.events.unit() * total;
        if pick < background {
            return Source::Background;
        }
        pick -= background;
        if pick < hot {
            return Source::Hot;
        }
        pick -= hot;
        if pick < moving {
            let share = self.config.polarity_share;
            let on_share = if travel > 0.0 { 1.0 - share } else { share };
            return Source::Motion { depth_mm, on_share };
        }
        pick -= moving;
        let relaxing = 1.0 - self.decay;
        for (k, site) in self.sites.iter().enumerate() {
            pick -= site.left * relaxing;
            if pick < 0.0 {
                return Source::Relaxing(k);
            }
        }
        Source::Background // rounding at the very end of the range
    }

    fn emit(&mut self, t_ns: i64, source: Source) -> Option<PixelEvent> {
        let newest = self.sites.len().wrapping_sub(1);
        let (x, y, on_share) = match source {
            Source::Background => {
                let x = self.events.between(0.0, f64::from(SENSOR_WIDTH));
                let y = self.events.between(0.0, f64::from(SENSOR_HEIGHT));
                (x, y, 0.48)
            }
            Source::Hot => {
                // The k-th hottest has a weight of 1/k.
                let mut pick = self.events.unit() * self.hot_hz;
                let mut chosen = 0;
                for k in 0..self.hot.len() {
                    chosen = k;
                    pick -= self.config.hottest_hz / (k + 1) as f64;
                    if pick < 0.0 {
                        break;
                    }
                }
                let (x, y) = *self.hot.get(chosen)?;
                (f64::from(x), f64::from(y), 0.48)
            }
            Source::Motion { depth_mm, on_share } => {
                let (x, y) = self.around(newest, depth_mm)?;
                (x, y, on_share)
            }
            Source::Relaxing(site) => {
                let (x, y) = self.around(site, 2.0)?;
                (x, y, 0.5)
            }
        };
        let on = self.events.unit() < on_share;
        let inside = (0.0..f64::from(SENSOR_WIDTH)).contains(&x)
            && (0.0..f64::from(SENSOR_HEIGHT)).contains(&y);
        inside.then(|| PixelEvent {
            t_ns,
            x: x as u16,
            y: y as u16,
            polarity: Polarity::from_bit(on),
        })
    }

    /// A pixel near the contact: a point of the footprint plus halo, and a row near the middle of the skin.
    fn around(&mut self, site: usize, depth_mm: f64) -> Option<(f64, f64)> {
        let site = self.sites.get(site)?;
        let point = ((self.events.bits() >> 32) * site.columns.len() as u64) >> 32;
        let halo = site.halo_px * (depth_mm.max(0.0) / 2.0).sqrt();
        let x = site.columns.get(point as usize)? + halo * self.events.gauss();
        let (low, high) = self.scene.skin_rows;
        let (low, high) = (f64::from(low), f64::from(high));
        let sigma = self.config.row_share * (high - low);
        let y = (low + high + 1.0) / 2.0 + sigma * self.events.gauss();
        // A point outside the field of view is NaN, which is in no column range.
        Some((x, y))
    }
}

impl PixelModel for GeometricModel {
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>) {
        for &tip in tips {
            if let Some(last) = self.last
                && last.t_ns < tip.t_ns
            {
                self.step(last, tip, out);
            }
            self.last = Some(tip);
        }
    }
}
