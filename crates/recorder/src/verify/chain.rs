//! Verification of the seals that further legs removed.

use super::report::VerifyReport;
use crate::chain::{self, PreviousSeal};
use crate::reader::SessionReader;

/// Verifies every leg that removed a seal.
pub(super) fn check(reader: &SessionReader, report: &mut VerifyReport) {
    let links = reader.query("checking the seals before its legs", async |conn| {
        chain::check(conn).await
    });
    for (leg, link) in report.ok_or_add(links).unwrap_or_default() {
        match link {
            PreviousSeal::Verified => {}
            PreviousSeal::Unverifiable => report.remarks.push(format!(
                "leg {leg}: the previous seal was removed by a version of skinrig that kept only its tree hash, which cannot be \
                 compared with the rows"
            )),
            PreviousSeal::Mismatch(differences) => {
                for difference in differences {
                    let place = format!("leg {leg}: {}", difference.place);
                    report.mismatch(place, difference.expected, difference.found);
                }
            }
        }
    }
}
