//! The pixels of one camera: thresholds and refractory time.
//!
//! A pixel stores the light at its last event and emits the next one when the light has changed by its threshold (in log
//! intensity). Each pixel stores the two lights at which it emits next, and each block of rows and each column the least change of
//! light that reaches one of them: no other block is evaluated while dents move.

use std::ops::Range;

use skinrig_model::{Polarity, SENSOR_WIDTH};
use skinrig_simd::InstructionSet;

use crate::random::Stream;
use crate::scene::{GRID_NS, PixelEvent, SceneConfig};

use super::column::{Block, LANES, Rows, lesser};
use super::config::OpticalConfig;
use super::refractory::{Refractory, RefractoryTimes};
use super::touches::Touches;

const NS_PER_US: i64 = 1_000;
const STEP_US: i64 = GRID_NS / NS_PER_US;
/// Lower limit on a pixel's threshold after mismatch, log intensity.
const LEAST_THRESHOLD: f64 = 0.01;
const WIDTH: usize = SENSOR_WIDTH as usize;

/// All pixels of a camera. Pixels that see the skin are stored column by column, in blocks of rows.
#[derive(Debug, Clone)]
pub(super) struct Pixels {
    rows: Range<usize>,
    /// Blocks of rows in a column.
    blocks: usize,
    pixels: Vec<Block>,
    refractory: Refractory,
    refractory_us: RefractoryTimes,
    /// Per column: least change of its lost light since the last evaluation that can cause an event.
    slack: Vec<f32>,
    /// The same per block of rows, as of the column's last evaluation.
    block_slack: Vec<f32>,
    /// No column has an event before one has lost or regained so much light.
    margin: f32,
    instructions: InstructionSet,
}

impl Pixels {
    pub(super) fn new(scene: &SceneConfig, config: &OpticalConfig, random: &mut Stream) -> Self {
        let [on, off, sigma] = match config.parts.uneven_pixels {
            Some(p) => [p.threshold, p.threshold, p.threshold_sigma],
            None => [
                config.threshold_on,
                config.threshold_off,
                config.threshold_sigma,
            ],
        };
        let rows = scene.rows();
        let blocks = rows.len().div_ceil(LANES);
        let silent = Block {
            bounds: Rows::SILENT,
            factors: Rows::SILENT,
        };
        let mut all = vec![silent; WIDTH * blocks];
        for i in 0..WIDTH * rows.len() {
            let mut threshold = |mean: f64| (mean + sigma * random.gauss()).max(LEAST_THRESHOLD);
            let (rise, fall) = (threshold(on), threshold(off));
            // The last event before the session left each pixel's reference anywhere between its
            // thresholds.
            let reference = libm::exp(0.5 * (random.unit() * (rise + fall) - rise));
            let (up, down) = (libm::exp(rise), libm::exp(-fall));
            let (u, v) = (i / rows.len(), i % rows.len());
            let (block, lane) = (&mut all[u * blocks + v / LANES], v % LANES);
            block.factors.up[lane] = up as f32;
            block.factors.down[lane] = down as f32;
            block.bounds.up[lane] = (reference * up) as f32;
            block.bounds.down[lane] = (reference * down) as f32;
        }
        Self {
            instructions: InstructionSet::best(),
            rows,
            blocks,
            pixels: all,
            refractory: Refractory::new(),
            refractory_us: RefractoryTimes::new(scene, config),
            slack: vec![f32::NEG_INFINITY; WIDTH],
            block_slack: vec![f32::NEG_INFINITY; WIDTH * blocks],
            margin: f32::NEG_INFINITY,
        }
    }

    /// Simulates the grid step from `t_ns`, through which the touches have moved.
    pub(super) fn step(&mut self, touches: &mut Touches, t_ns: i64, out: &mut Vec<PixelEvent>) {
        self.release(touches, t_ns, out);
        if touches.rest() {
            return;
        }
        for columns in &touches.disturbed {
            self.slack[columns.clone()].fill(f32::NEG_INFINITY);
            let blocks = columns.start * self.blocks..columns.end * self.blocks;
            self.block_slack[blocks].fill(f32::NEG_INFINITY);
            self.margin = f32::NEG_INFINITY;
        }
        self.margin -= touches.largest_change();
        if self.margin > 0.0 {
            return;
        }
        let columns = touches.columns();
        let mut left = [0.0; WIDTH];
        touches.changes(&mut left);
        let left = &mut left[columns.clone()];
        let slack = &self.slack[columns.clone()];
        let mut due = self.instructions.run(
            #[inline(always)]
            || subtract_from(slack, left),
        );
        while due != 0 {
            let first = due.trailing_zeros() as usize * LANES;
            due &= due - 1;
            for (left, k) in left[first..first + LANES].iter_mut().zip(first..) {
                if *left < 0.0 {
                    let u = columns.start + k;
                    self.evaluate(touches, u, t_ns, out);
                    *left = self.slack[u];
                }
            }
        }
        self.margin = self.instructions.run(
            #[inline(always)]
            || least(left),
        );
    }

    #[cfg(test)]
    pub(super) fn use_instructions(&mut self, set: InstructionSet) {
        self.instructions = set;
    }

    /// Every column is evaluated in the next step.
    #[cfg(test)]
    pub(super) fn forget_slack(&mut self) {
        self.slack.fill(f32::NEG_INFINITY);
        self.block_slack.fill(f32::NEG_INFINITY);
        self.margin = f32::NEG_INFINITY;
    }

    /// Adds an event not caused by light. Returns false when the pixel is in its refractory time.
    pub(super) fn inject(&mut self, event: PixelEvent, out: &mut Vec<PixelEvent>) -> bool {
        let (x, y) = (event.x, event.y);
        if let Some(k) = self.refractory.position(x, y)
            && event.t_ns < self.refractory.pixels[k].2
        {
            return false;
        }
        out.push(event);
        let refractory_ns = self.refractory_us.of(x, y) * NS_PER_US;
        self.refractory.set(x, y, event.t_ns + refractory_ns);
        let v = usize::from(y);
        if self.rows.contains(&v) {
            self.hold(self.block(usize::from(x), v - self.rows.start));
        }
        true
    }

    /// Block and lane of the pixel in column `u` and the skin's row `v`.
    const fn block(&self, u: usize, v: usize) -> (usize, usize) {
        (u * self.blocks + v / LANES, v % LANES)
    }

    /// Lights at which a pixel emits.
    fn bounds(&self, (block, lane): (usize, usize)) -> (f64, f64) {
        let rows = &self.pixels[block].bounds;
        (f64::from(rows.up[lane]), f64::from(rows.down[lane]))
    }

    fn hold(&mut self, (block, lane): (usize, usize)) {
        let rows = &mut self.pixels[block].bounds;
        (rows.up[lane], rows.down[lane]) = (f32::INFINITY, f32::NEG_INFINITY);
    }

    fn set_reference(&mut self, (block, lane): (usize, usize), light: f64) {
        let (light, block) = (light as f32, &mut self.pixels[block]);
        block.bounds.up[lane] = light * block.factors.up[lane];
        block.bounds.down[lane] = light * block.factors.down[lane];
    }

    /// Pixels whose refractory time ends in the step take the light at that time as their reference.
    fn release(&mut self, touches: &mut Touches, t_ns: i64, out: &mut Vec<PixelEvent>) {
        let mut k = 0;
        while k < self.refractory.pixels.len() {
            let (x, y, end_ns) = self.refractory.pixels[k];
            let again_ns = if end_ns < t_ns + GRID_NS {
                self.release_one(touches, (x, y), end_ns, t_ns, out)
            } else {
                None
            };
            if let Some(end_ns) = again_ns {
                self.refractory.pixels[k].2 = end_ns;
            } else if end_ns <= t_ns {
                self.refractory.remove(k);
                continue;
            }
            k += 1;
        }
    }

    /// Releases one pixel if it is held. Returns the end of its next refractory time if it emits at once.
    fn release_one(
        &mut self,
        touches: &mut Touches,
        (x, y): (u16, u16),
        end_ns: i64,
        t_ns: i64,
        out: &mut Vec<PixelEvent>,
    ) -> Option<i64> {
        let u = usize::from(x);
        let v = usize::from(y).checked_sub(self.rows.start)?;
        if v >= self.rows.len() {
            return None;
        }
        let pixel = self.block(u, v);
        if self.bounds(pixel).0.is_finite() {
            // It ended within the step of its event.
            return None;
        }
        touches.look(u);
        touches.look_back(u);
        let light = touches.light(v);
        let us = ((end_ns - t_ns) / NS_PER_US).max(0);
        self.set_reference(pixel, at_us(light, us));
        let again_ns = self.emit((u, v), light, t_ns, us, out);
        // What has changed since the last evaluation may change back.
        let (up, down) = self.bounds(pixel);
        let left = (up - light[1]).min(light[1] - down) as f32;
        let slack = left / (touches.most(v) + f32::MIN_POSITIVE) - touches.change(u);
        self.slack[u] = lesser(self.slack[u], slack);
        self.block_slack[pixel.0] = lesser(self.block_slack[pixel.0], slack);
        self.margin = lesser(self.margin, slack - touches.change(u));
        again_ns
    }

    /// Emits the events of one column and stores the least change of its light that causes the next one. Blocks that the
    /// column's change of light cannot have taken to an event are not evaluated.
    fn evaluate(&mut self, touches: &mut Touches, u: usize, t_ns: i64, out: &mut Vec<PixelEvent>) {
        let change = touches.change(u);
        let most = touches.evaluate(u);
        let first = u * self.blocks;
        let blocks = first..first + self.blocks;
        let (pixels, slack) = (
            &self.pixels[blocks.clone()],
            &mut self.block_slack[blocks.clone()],
        );
        let crossed = self.instructions.run(
            #[inline(always)]
            || {
                for slack in &mut *slack {
                    *slack -= change;
                }
                update(slack, pixels, touches)
            },
        );
        if crossed != 0 {
            touches.look_back(u);
            let mut left = crossed;
            while left != 0 {
                let block = left.trailing_zeros() as usize;
                left &= left - 1;
                for v in block * LANES..self.rows.len().min((block + 1) * LANES) {
                    let light = touches.light(v);
                    if let Some(end_ns) = self.emit((u, v), light, t_ns, 0, out) {
                        let (x, y) = (u as u16, (v + self.rows.start) as u16);
                        self.refractory.set(x, y, end_ns);
                    }
                }
            }
            let (pixels, slack) = (
                &self.pixels[blocks.clone()],
                &mut self.block_slack[blocks.clone()],
            );
            self.instructions.run(
                #[inline(always)]
                || update(slack, pixels, touches),
            );
        }
        let slack = &self.block_slack[blocks];
        let left = self.instructions.run(
            #[inline(always)]
            || least(slack),
        );
        self.slack[u] = lesser(left, most);
    }

    /// Emits all events of one pixel, whose light changes linearly during the step, from `from_us` to its end. Returns the end of
    /// the last one's refractory time.
    fn emit(
        &mut self,
        (u, v): (usize, usize),
        light: [f64; 2],
        t_ns: i64,
        mut from_us: i64,
        out: &mut Vec<PixelEvent>,
    ) -> Option<i64> {
        let pixel = self.block(u, v);
        let (x, y) = (u as u16, (v + self.rows.start) as u16);
        let refractory_us = self.refractory_us.of(x, y);
        let mut last_us = None;
        loop {
            let (up, down) = self.bounds(pixel);
            let (bound, polarity) = if light[1] > up {
                (up, Polarity::On)
            } else if light[1] < down {
                (down, Polarity::Off)
            } else {
                break;
            };
            let part = (bound - light[0]) / (light[1] - light[0]);
            let us = if part > 0.0 {
                (part * STEP_US as f64) as i64
            } else {
                0
            };
            let us = us.clamp(from_us, STEP_US - 1);
            let t_ns = t_ns + us * NS_PER_US;
            out.push(PixelEvent {
                t_ns,
                x,
                y,
                polarity,
            });
            last_us = Some(us);
            from_us = us + refractory_us;
            if from_us >= STEP_US {
                self.hold(pixel);
                break;
            }
            self.set_reference(pixel, at_us(light, from_us));
        }
        last_us.map(|us| t_ns + (us + refractory_us) * NS_PER_US)
    }
}

/// Light `us` after the start of a step.
fn at_us(light: [f64; 2], us: i64) -> f64 {
    light[0] + (light[1] - light[0]) * (us as f64 / STEP_US as f64)
}

/// Subtracts each change from its slack. Returns one bit per block of columns: whether one's slack is used up. There are at most 80
/// blocks.
#[inline(always)]
fn subtract_from(slack: &[f32], changes: &mut [f32]) -> u128 {
    let mut due = 0;
    let blocks = slack.as_chunks::<LANES>().0;
    for (n, (left, slack)) in changes
        .as_chunks_mut::<LANES>()
        .0
        .iter_mut()
        .zip(blocks)
        .enumerate()
    {
        let mut any = false;
        for k in 0..LANES {
            left[k] = slack[k] - left[k];
            any |= left[k] < 0.0;
        }
        due |= u128::from(any) << n;
    }
    due
}

/// The least value.
#[inline(always)]
fn least(values: &[f32]) -> f32 {
    let mut least = [f32::INFINITY; LANES];
    let (blocks, rest) = values.as_chunks::<LANES>();
    for block in blocks {
        for k in 0..LANES {
            least[k] = lesser(least[k], block[k]);
        }
    }
    least
        .iter()
        .chain(rest)
        .copied()
        .fold(f32::INFINITY, lesser)
}

/// Evaluates the blocks of a column whose slack is used up. Returns one bit per block: whether a pixel is beyond its event. A column
/// has at most 60 blocks.
#[inline(always)]
fn update(slack: &mut [f32], pixels: &[Block], touches: &Touches) -> u64 {
    let mut crossed = 0;
    for (n, (slack, pixels)) in slack.iter_mut().zip(pixels).enumerate() {
        if *slack < 0.0 {
            *slack = touches.block(n).slack(pixels);
            crossed |= u64::from(*slack < 0.0) << n;
        }
    }
    crossed
}
