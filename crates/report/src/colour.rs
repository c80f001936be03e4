//! Owns the colour scales of the figures: viridis and blue-orange, readable with all common types of colour vision.
//!
//! Nine anchor colours from matplotlib's viridis table (at 0, 1/8, ... 1), with linear interpolation.

const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Colour at `share` of the scale as `#rrggbb`. Clamps to 0..=1; figures label the ends of the scale accordingly.
#[must_use]
pub(crate) fn viridis(share: f64) -> String {
    hex(viridis_rgb(share))
}

/// A colour as `#rrggbb`.
#[must_use]
pub(crate) fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// [`viridis`] as red, green and blue.
#[must_use]
pub(crate) fn viridis_rgb(share: f64) -> [u8; 3] {
    let share = if share.is_finite() {
        share.clamp(0.0, 1.0)
    } else {
        0.0
    };
    let at = share * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let t = at - i as f64;
    let mix = |c: usize| {
        let (a, b) = (f64::from(VIRIDIS[i][c]), f64::from(VIRIDIS[i + 1][c]));
        (a + t * (b - a)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// Blue (better) for -1, light grey for 0, orange (worse) for 1. Distinct in all common types of colour vision.
#[must_use]
pub(crate) fn diverging(share: f64) -> String {
    let share = share.clamp(-1.0, 1.0);
    let end = if share < 0.0 {
        [0x2b, 0x7b, 0xba]
    } else {
        [0xd9, 0x72, 0x1a]
    };
    let mix = |i: usize| {
        let (from, to) = (f64::from([0xec, 0xee, 0xf0][i]), f64::from(end[i]));
        (from + share.abs() * (to - from)).round() as u8
    };
    hex([mix(0), mix(1), mix(2)])
}

#[cfg(test)]
mod tests {
    use super::viridis;

    #[test]
    fn ends_and_middle_are_the_published_colours() {
        assert_eq!(viridis(0.0), "#440154");
        assert_eq!(viridis(0.5), "#21908d");
        assert_eq!(viridis(1.0), "#fde725");
        assert_eq!(viridis(f64::NAN), "#440154");
        assert_eq!(viridis(7.0), "#fde725");
    }
}
