//! Numbers side by side: exponentials and triangular matrices in groups of eight, for the kernels of Gaussian processes.
//!
//! Every loop is ordinary code over whole groups, which the compiler turns into the vector instructions of the processor
//! (`skinrig_simd`). Sums run lane by lane and are joined in a fixed order, so that results are the same to the last bit on every
//! machine (`docs/adr/0044-*`).

mod exponential;
mod factor;
mod lower;

pub(crate) use exponential::of_negatives;
pub(crate) use factor::Factor;
pub(crate) use lower::Lower;

/// Numbers in step.
pub(crate) const LANES: usize = 8;

/// Numbers side by side.
pub(crate) type Group = [f64; LANES];

/// Sum of the lanes, in a fixed order.
#[inline(always)]
pub(crate) fn total(lanes: &Group) -> f64 {
    let [a, b, c, d, e, f, g, h] = *lanes;
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}

/// `values` in whole groups, filled up with zeros.
pub(crate) fn groups(values: impl IntoIterator<Item = f64>) -> Vec<Group> {
    let mut all = Vec::new();
    for (i, value) in values.into_iter().enumerate() {
        if i % LANES == 0 {
            all.push([0.0; LANES]);
        }
        all[i / LANES][i % LANES] = value;
    }
    all
}
