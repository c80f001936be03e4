//! Checks the files and programs that the rig file names: bias files, lamp programs.

use super::case::Case;
use super::finding::{Finding, check};

/// A finding for each file and program that the rig file names.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let found = case.inputs.iter().map(|input| {
        let check = check("rig file", &input.key, &input.expected);
        match &input.found {
            Ok(found) => check.ok(found.display().to_string()),
            Err(why) => check.problem(why.to_string(), &input.next),
        }
    });
    found.collect()
}
