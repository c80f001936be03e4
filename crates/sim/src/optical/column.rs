//! The rows of one column, a block at a time in single precision: their light, and how far they are from events.

/// Rows that are evaluated at once.
pub(super) const LANES: usize = 8;

/// Light of a block's rows after the step, and the most that it changes per unit of lost light.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockLight {
    light: [f32; LANES],
    most: [f32; LANES],
    /// Most that the flanks behind a dent return.
    behind: [f32; LANES],
}

impl BlockLight {
    /// The light that comes from behind all dents.
    #[inline(always)]
    pub(super) const fn new(farthest: f32) -> Self {
        Self {
            light: [farthest; LANES],
            most: [0.0; LANES],
            behind: [0.0; LANES],
        }
    }

    /// The light passes a dent, the farthest first, whose shadow and shine weigh so much in these rows, and `joins` in front of it.
    #[inline(always)]
    pub(super) fn pass(
        &mut self,
        shadow_rows: &[f32; LANES],
        shine_rows: &[f32; LANES],
        farthest: bool,
        [lost, shadow, shine, joins]: [f32; 4],
    ) {
        for k in 0..LANES {
            let returned = shine * shine_rows[k];
            let dimmed = shadow_rows[k] * (shadow + self.behind[k]);
            self.most[k] = greater(self.most[k], sensitivity(farthest, returned, dimmed));
            self.behind[k] += returned;
            self.light[k] += lost * (returned - shadow_rows[k] * self.light[k]) + joins;
        }
    }

    /// Least change of the lost light that takes a pixel of the block to an event; negative if one is beyond it.
    #[inline(always)]
    pub(super) fn slack(&self, block: &Block) -> f32 {
        let Rows { up, down } = &block.bounds;
        let mut least = [0.0; LANES];
        for k in 0..LANES {
            // A row that no dent changes is as far as can be, or beyond.
            let left = lesser(up[k] - self.light[k], self.light[k] - down[k]);
            least[k] = left / (self.most[k] + f32::MIN_POSITIVE);
        }
        least.into_iter().fold(f32::INFINITY, lesser)
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
