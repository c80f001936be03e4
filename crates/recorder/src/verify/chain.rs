//! The seals that further legs took off, held against the rows that they covered.

use super::report::VerifyReport;
use crate::chain::{self, Link};
use crate::reader::SessionReader;

/// Checks every leg that took a seal off.
pub fn check(reader: &SessionReader, report: &mut VerifyReport) {
    let links = reader.ask("checking the seals before its legs", async |conn| {
        chain::check(conn).await
    });
    for (leg, link) in report.take(links).unwrap_or_default() {
        match link {
            Link::Proven => {}
            Link::Unprovable => report.remarks.push(format!(
                "leg {leg}: the seal before it was taken off by a version of skinrig that kept only its tree hash, which cannot be \
                 held against the rows"
            )),
            Link::Broken(differences) => {
                for difference in differences {
                    report.add(format!("leg {leg}: {difference}"));
                }
            }
        }
    }
}
