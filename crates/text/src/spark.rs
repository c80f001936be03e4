//! Sparklines: one block per value.

/// Characters that a terminal shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blocks {
    /// Eighths of a block.
    Unicode,
    /// Characters of ASCII, the lower the emptier.
    Ascii,
}

/// One block per share of the height, 0 to 1 (others count as the nearer end); a space for a missing one.
#[must_use]
pub fn sparkline(shares: impl IntoIterator<Item = Option<f64>>, blocks: Blocks) -> String {
    let blocks: [char; 8] = match blocks {
        Blocks::Unicode => ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'],
        Blocks::Ascii => ['_', '.', ',', '-', '=', '+', '*', '#'],
    };
    let block = |share: f64| blocks[(share.clamp(0.0, 1.0) * 7.0).round() as usize];
    let shares = shares.into_iter();
    shares.map(|share| share.map_or(' ', block)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_middle_and_gaps_have_their_blocks() {
        let shares = [Some(0.0), None, Some(0.5), Some(1.0), Some(9.0), Some(-9.0)];
        assert_eq!(sparkline(shares, Blocks::Unicode), "▁ ▅██▁");
        assert_eq!(sparkline(shares, Blocks::Ascii), "_ =##_");
        assert_eq!(sparkline([], Blocks::Ascii), "");
    }
}
