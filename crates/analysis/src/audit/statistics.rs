//! Rank correlation and its comparison, and robust spread.

use crate::metrics::quantile;

/// The median; `None` without values.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    quantile(&mut values, 0.5)
}

/// Spearman's rank correlation (mean ranks for ties); `None` with fewer than 3 pairs or without spread.
pub fn spearman(pairs: &[(f64, f64)]) -> Option<f64> {
    if pairs.len() < 3 {
        return None;
    }
    let a = ranks(pairs.iter().map(|p| p.0).collect());
    let b = ranks(pairs.iter().map(|p| p.1).collect());
    let middle = (pairs.len() as f64 + 1.0) / 2.0;
    let product = |x: &[f64], y: &[f64]| -> f64 {
        let terms = x.iter().zip(y);
        terms.map(|(x, y)| (x - middle) * (y - middle)).sum()
    };
    let (aa, bb) = (product(&a, &a), product(&b, &b));
    (aa > 0.0 && bb > 0.0).then(|| (product(&a, &b) / (aa * bb).sqrt()).clamp(-1.0, 1.0))
}

fn ranks(values: Vec<f64>) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut from = 0;
    while from < order.len() {
        let tied = order[from..].iter();
        let to = from
            + tied
                .take_while(|i| values[**i] == values[order[from]])
                .count();
        let to = to.max(from + 1);
        for i in &order[from..to] {
            ranks[*i] = (from + 1 + to) as f64 / 2.0;
        }
        from = to;
    }
    ranks
}

/// Fisher's z of a correlation from `n` independent pairs. A perfect one is taken as `1 - 1/n²`: with few pairs, a
/// perfect order is no proof.
pub fn fisher_z(r: f64, n: usize) -> f64 {
    let most = 1.0 - 1.0 / (n as f64).powi(2);
    libm::atanh(r.clamp(-most, most))
}

/// Standard normal score of the difference between two correlations, `ra` and `rb`, with the same variable over
/// the same `n` pairs; `between` is the correlation of the other two variables. Meng, Rosenthal and Rubin,
/// "Comparing correlated correlation coefficients", Psychological Bulletin 111 (1992), equation 1.
pub fn compare(ra: f64, rb: f64, between: f64, n: usize) -> f64 {
    if n < 4 {
        return 0.0;
    }
    let square = 0.5 * (ra * ra + rb * rb);
    let rest = (1.0 - square).max(1e-9);
    let f = ((1.0 - between) / (2.0 * rest)).min(1.0);
    let h = (1.0 - f * square) / rest;
    // Nearly the same variable: no difference can be told.
    let overlap = 2.0 * (1.0 - between).max(1e-6) * h;
    (fisher_z(ra, n) - fisher_z(rb, n)) * ((n as f64 - 3.0) / overlap).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlation_by_hand() {
        let pairs = |b: [f64; 5]| -> Vec<(f64, f64)> { (0..5).map(f64::from).zip(b).collect() };
        // Any monotone course is perfect; one exchange of neighbours costs 6 * 2 / (5 * 24).
        assert_eq!(spearman(&pairs([1.0, 2.0, 4.0, 8.0, 1e9])), Some(1.0));
        assert_eq!(spearman(&pairs([5.0, 4.0, 3.0, 2.0, 1.0])), Some(-1.0));
        let one = spearman(&pairs([1.0, 2.0, 4.0, 3.0, 5.0])).unwrap_or(0.0);
        assert!((one - 0.9).abs() < 1e-12);
        // Ties share their mean rank: ranks 1, 2.5, 2.5, 4, 5 give 9.5 / sqrt(10 * 9.5).
        let tied = spearman(&pairs([1.0, 2.0, 2.0, 4.0, 5.0])).unwrap_or(0.0);
        assert!((tied - 9.5 / 95f64.sqrt()).abs() < 1e-12);
        assert_eq!(spearman(&pairs([1.0; 5])), None);
        assert_eq!(spearman(&[(0.0, 1.0), (1.0, 2.0)]), None);
    }

    #[test]
    fn compared_correlations_by_hand() {
        // square 0.2, f 0.7 / 1.6 = 0.4375, h 0.9125 / 0.8, z 0.693147 - 0.202733, over sqrt(1.596875 / 25).
        let z = compare(0.6, 0.2, 0.3, 28);
        assert!((z - 1.940_43).abs() < 1e-4, "{z}");
        assert_eq!(compare(0.5, 0.5, 0.2, 30), 0.0);
        assert!(compare(1.0, -1.0, -1.0, 9) > 4.0);
        assert!(compare(1.0, 1.0, 1.0, 9).is_finite());
    }
}
