//! Symmetric band matrices with three further diagonals: factorisation, solution and the band of the inverse.

/// A symmetric matrix with three further diagonals: for each row its diagonal and the next three entries.
pub(crate) type Band = Vec<[f64; 4]>;

/// `w' C w` for weights of four neighbours.
pub(crate) fn quadratic(c: &Band, first: usize, w: &[f64; 4]) -> f64 {
    let mut sum = 0.0;
    for i in 0..4 {
        sum += w[i] * w[i] * c[first + i][0];
        for j in i + 1..4 {
            sum += 2.0 * w[i] * w[j] * c[first + i][j - i];
        }
    }
    sum
}

/// Cholesky factor of a positive definite band matrix: `l[i][k]` is entry (i + k, i). `None` if it is not positive definite.
pub(super) fn factor(a: &Band) -> Option<Band> {
    let n = a.len();
    let mut l = a.clone();
    for i in 0..n {
        let pivot = l[i][0];
        if pivot.is_nan() || pivot <= 1e-14 * a[i][0] {
            return None;
        }
        let root = pivot.sqrt();
        for v in &mut l[i] {
            *v /= root;
        }
        l[i][0] = root;
        for k in 1..4.min(n - i) {
            for m in k..4.min(n - i) {
                l[i + k][m - k] -= l[i][k] * l[i][m];
            }
        }
    }
    Some(l)
}

/// Solves `l l' x = b`.
pub(crate) fn solve(l: &Band, b: &[f64]) -> Vec<f64> {
    let n = l.len();
    let mut x = b.to_vec();
    for i in 0..n {
        x[i] /= l[i][0];
        for k in 1..4.min(n - i) {
            x[i + k] -= l[i][k] * x[i];
        }
    }
    for i in (0..n).rev() {
        for k in 1..4.min(n - i) {
            x[i] -= l[i][k] * x[i + k];
        }
        x[i] /= l[i][0];
    }
    x
}

/// Band of the inverse of `l l'` (Takahashi, Fagan and Chin 1973).
pub(crate) fn inverse_band(l: &Band) -> Band {
    let n = l.len();
    let mut z = vec![[0.0; 4]; n];
    for i in (0..n).rev() {
        let last = 4.min(n - i);
        for k in (1..last).rev() {
            let mut sum = 0.0;
            for (m, factor) in l[i].iter().enumerate().take(last).skip(1) {
                let (a, b) = (i + k.min(m), k.abs_diff(m));
                sum += factor * z[a][b];
            }
            z[i][k] = -sum / l[i][0];
        }
        let mut sum = 1.0 / l[i][0];
        for (factor, inverse) in l[i].iter().zip(&z[i]).take(last).skip(1) {
            sum -= factor * inverse;
        }
        z[i][0] = sum / l[i][0];
    }
    z
}

/// `a' b`.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
