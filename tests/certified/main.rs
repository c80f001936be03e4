//! Problems with certified answers, solved by skinrig's public functions: each result has the digits that its condition number
//! allows, and what has no answer is refused with a type. `README.md` of this package describes the data and holds the table.

#![expect(clippy::unwrap_used, reason = "tests")]

mod calibration;
mod clocks;
mod clusters;
mod data;
mod digits;
mod fields;
mod problem;
mod quantiles;
mod sums;
mod table;
mod triangulation;
