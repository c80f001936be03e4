//! The rows of one column, several at a time in single precision: their light, and how far they are from events.

use super::dent::Dent;

/// Rows that are evaluated at once.
pub(super) const LANES: usize = 8;

/// Light of each of a column's rows after the step, and the most that it changes per unit of lost light.
#[derive(Debug, Clone)]
pub(super) struct ColumnLight {
    light: Vec<f32>,
    most: Vec<f32>,
    /// Most that the flanks behind a dent return.
    behind: Vec<f32>,
}

impl ColumnLight {
    /// For so many rows.
    pub(super) fn new(rows: usize) -> Self {
        Self {
            light: vec![0.0; rows],
            most: vec![0.0; rows],
            behind: vec![0.0; rows],
        }
    }

    #[inline(always)]
    pub(super) fn start(&mut self, farthest: f32) {
        self.light.fill(farthest);
        self.most.fill(0.0);
        self.behind.fill(0.0);
    }

    /// The light passes a dent, the farthest first, and `joins` in front of it.
    #[inline(always)]
    pub(super) fn pass(
        &mut self,
        dent: &Dent,
        farthest: bool,
        [lost, shadow, shine, joins]: [f32; 4],
    ) {
        let rows = dent.shadow_rows.iter().zip(&dent.shine_rows);
        for (((light, most), behind), (shadow_row, shine_row)) in self
            .light
            .iter_mut()
            .zip(&mut self.most)
            .zip(&mut self.behind)
            .zip(rows)
        {
            let returned = shine * shine_row;
            let dimmed = shadow_row * (shadow + *behind);
            *most = greater(*most, sensitivity(farthest, returned, dimmed));
            *behind += returned;
            *light += lost * (returned - shadow_row * *light) + joins;
        }
    }
}

/// Values of eight rows for rising and for falling light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows {
    pub(super) up: [f32; LANES],
    pub(super) down: [f32; LANES],
}

impl Rows {
    /// Of pixels that never emit: those in their refractory time.
    pub(super) const SILENT: Self = Self {
        up: [f32::INFINITY; LANES],
        down: [f32::NEG_INFINITY; LANES],
    };
}

/// The pixels of eight rows, in two neighbouring lines of the processor's cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(128))]
pub(super) struct Block {
    /// A pixel emits when its light, undisturbed = 1, rises above or falls below these.
    pub(super) bounds: Rows,
    /// Factors on the light at the last event for the next ON event, above 1, and OFF event, below 1.
    pub(super) factors: Rows,
}

/// Least change of the lost light that takes a pixel of the column to an event; negative if one is beyond it.
#[inline(always)]
pub(super) fn least_slack(column: &ColumnLight, pixels: &[Block]) -> f32 {
    let mut least = [f32::INFINITY; LANES];
    let lights = column.light.as_chunks::<LANES>().0;
    let mosts = column.most.as_chunks::<LANES>().0;
    for ((light, most), block) in lights.iter().zip(mosts).zip(pixels) {
        let Rows { up, down } = &block.bounds;
        for k in 0..LANES {
            // A row that no dent changes is as far as can be, or beyond.
            let left = lesser(up[k] - light[k], light[k] - down[k]);
            least[k] = lesser(left / (most[k] + f32::MIN_POSITIVE), least[k]);
        }
    }
    least.into_iter().fold(f32::INFINITY, lesser)
}

/// One bit per block of the column: whether a pixel is beyond its event. A column has at most 60 blocks.
#[inline(always)]
pub(super) fn crossed_blocks(column: &ColumnLight, pixels: &[Block]) -> u64 {
    let mut crossed = 0;
    let lights = column.light.as_chunks::<LANES>().0;
    for (n, (light, block)) in lights.iter().zip(pixels).enumerate() {
        let Rows { up, down } = &block.bounds;
        let mut beyond = false;
        for k in 0..LANES {
            beyond |= light[k] > up[k] || light[k] < down[k];
        }
        crossed |= u64::from(beyond) << n;
    }
    crossed
}

/// The lesser number; compiles to one instruction for several rows at once.
#[inline(always)]
pub(super) const fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Most that the light changes per unit of light that a dent loses. What the farthest dent dims does not change; what another one
/// dims may be anything up to `dimmed`.
#[inline(always)]
pub(super) const fn sensitivity(farthest: bool, returned: f32, dimmed: f32) -> f32 {
    if farthest {
        (returned - dimmed).abs()
    } else {
        greater(returned, dimmed)
    }
}

/// The greater number; compiles to one instruction for several rows at once.
#[inline(always)]
pub(super) const fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
