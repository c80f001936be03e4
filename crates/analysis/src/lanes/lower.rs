//! Square matrices of which only the lower triangle counts.

use super::{Group, LANES, total};

/// A lower triangle, column by column. Each column begins with the group that holds its diagonal element and ends with a whole
/// group; places above the diagonal and beyond the last row hold zeros.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lower {
    n: usize,
    values: Vec<Group>,
    /// Where each column begins, and the end of the last one.
    begins: Vec<usize>,
}

impl Lower {
    /// Nothing but zeros.
    pub(crate) fn zeros(n: usize) -> Self {
        let groups = n.div_ceil(LANES);
        let mut begins = vec![0; n + 1];
        for j in 0..n {
            begins[j + 1] = begins[j] + groups - j / LANES;
        }
        Self {
            n,
            values: vec![[0.0; LANES]; begins[n]],
            begins,
        }
    }

    /// Element (i, j) is `of(i, j)`, for i >= j.
    pub(crate) fn from_fn(n: usize, of: impl Fn(usize, usize) -> f64) -> Self {
        let mut lower = Self::zeros(n);
        for j in 0..n {
            for i in j..n {
                lower.set(i, j, of(i, j));
            }
        }
        lower
    }

    /// Rows and columns.
    pub(crate) const fn n(&self) -> usize {
        self.n
    }

    /// Column `j`, from group `j / LANES` of the rows on.
    #[inline(always)]
    pub(crate) fn column(&self, j: usize) -> &[Group] {
        &self.values[self.begins[j]..self.begins[j + 1]]
    }

    #[inline(always)]
    pub(super) fn column_mut(&mut self, j: usize) -> &mut [Group] {
        &mut self.values[self.begins[j]..self.begins[j + 1]]
    }

    /// Column `j` to change, and the columns before it to read.
    #[inline(always)]
    pub(super) fn column_after(&mut self, j: usize) -> (&mut [Group], Columns<'_>) {
        let (before, rest) = self.values.split_at_mut(self.begins[j]);
        let end = self.begins[j + 1] - self.begins[j];
        let begins = &self.begins;
        (&mut rest[..end], Columns { before, begins })
    }

    /// Element (i, j), i >= j.
    #[inline(always)]
    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        self.column(j)[i / LANES - j / LANES][i % LANES]
    }

    /// Changes element (i, j), i >= j.
    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, j: usize, value: f64) {
        self.column_mut(j)[i / LANES - j / LANES][i % LANES] = value;
    }

    /// Adds `of(j)` to the diagonal.
    pub(crate) fn add_to_diagonal(&mut self, of: impl Fn(usize) -> f64) {
        for j in 0..self.n {
            self.set(j, j, self.get(j, j) + of(j));
        }
    }

    /// Groups of the inputs combined, below the diagonal; the diagonal becomes zero.
    #[inline(always)]
    pub(crate) fn combine<const N: usize>(
        inputs: [&Self; N],
        of: impl Fn([&Group; N]) -> Group,
    ) -> Self {
        let mut combined = Self::zeros(inputs[0].n);
        for (i, group) in combined.values.iter_mut().enumerate() {
            *group = of(inputs.map(|lower| &lower.values[i]));
        }
        combined.clear_outside();
        combined
    }

    /// Sums over all elements: `of` the groups of the inputs, of those of `by_row`, and of the element of `by_row` that belongs to the
    /// column. `of` must be zero wherever one of the inputs is zero.
    #[inline(always)]
    pub(crate) fn sums<const N: usize, const M: usize>(
        inputs: [&Self; N],
        by_row: &[Group],
        of: impl Fn([&Group; N], &Group, f64) -> [Group; M],
    ) -> [f64; M] {
        let mut sums = [[0.0; LANES]; M];
        for j in 0..inputs[0].n {
            let by_column = by_row[j / LANES][j % LANES];
            let rows = &by_row[j / LANES..];
            let columns = inputs.map(|lower| &lower.column(j)[..rows.len()]);
            for (g, rows) in rows.iter().enumerate() {
                let parts = of(columns.map(|column| &column[g]), rows, by_column);
                for (sum, part) in sums.iter_mut().zip(parts) {
                    for i in 0..LANES {
                        sum[i] += part[i];
                    }
                }
            }
        }
        sums.map(|lanes| total(&lanes))
    }

    /// Zeros on the diagonal, above it and beyond the last row.
    fn clear_outside(&mut self) {
        let n = self.n;
        for j in 0..n {
            let column = self.column_mut(j);
            column[0][..=j % LANES].fill(0.0);
            if let (Some(last), filled @ 1..) = (column.last_mut(), n % LANES) {
                last[filled..].fill(0.0);
            }
        }
    }
}

/// Columns before one that changes.
#[derive(Clone, Copy)]
pub(super) struct Columns<'a> {
    before: &'a [Group],
    begins: &'a [usize],
}

impl<'a> Columns<'a> {
    /// Column `k` from group `from` of the rows on.
    #[inline(always)]
    pub(super) fn from(&self, k: usize, from: usize) -> &'a [Group] {
        &self.before[self.begins[k] + from - k / LANES..self.begins[k + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::groups;

    #[test]
    fn elements_are_where_they_were_put_and_zeros_around_them() {
        for n in [1, 7, 8, 9, 24] {
            let lower = Lower::from_fn(n, |i, j| (100 * i + j + 1) as f64);
            for j in 0..n {
                let column = lower.column(j).as_flattened();
                let above = j % LANES;
                assert!(column[..above].iter().all(|v| *v == 0.0));
                assert!(column[above + n - j..].iter().all(|v| *v == 0.0));
                for i in j..n {
                    assert_eq!(lower.get(i, j), (100 * i + j + 1) as f64);
                }
            }
            let combined = Lower::combine([&lower, &lower], |[a, b]| {
                std::array::from_fn(|i| a[i] + 2.0 * b[i] + 1.0)
            });
            let expected = |i, j| {
                if i == j {
                    0.0
                } else {
                    3.0 * lower.get(i, j) + 1.0
                }
            };
            assert_eq!(combined, Lower::from_fn(n, expected));
            let rows = groups((0..n).map(|i| i as f64));
            let [sum] = Lower::sums([&combined], &rows, |[own], rows, column| {
                [std::array::from_fn(|i| own[i] * (rows[i] - column))]
            });
            let pairs = (0..n).flat_map(|j| (j + 1..n).map(move |i| (i, j)));
            let terms = pairs.map(|(i, j)| (3.0 * lower.get(i, j) + 1.0) * (i - j) as f64);
            assert_eq!(sum, terms.sum::<f64>());
        }
    }
}
