//! Owns the bins of histograms.

use crate::plot::tick_label;

/// Counts in `count` bins of `width` from `start`; the last one holds its upper end.
pub(super) fn histogram(values: &[f64], (start, width): (f64, f64), count: usize) -> Vec<u32> {
    let mut bins = vec![0u32; count.max(1)];
    let last = bins.len() - 1;
    for v in values {
        bins[(((v - start) / width) as usize).min(last)] += 1;
    }
    bins
}

/// Three digits of a bin width, without trailing zeros.
pub(super) fn bin_width(width: f64) -> String {
    let text = tick_label(width, width * 0.01);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
