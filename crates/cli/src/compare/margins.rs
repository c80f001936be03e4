//! Margins of a comparison, from the limits file and the command line.

use std::path::Path;

use skinrig_compare::{ComparisonOptions, Metric};
use skinrig_protocol::Limits;
use skinrig_statistics::AlphaSpending;

use crate::args::CompareArgs;
use crate::exit::Failure;

/// Default limits file, read if it exists.
const FILE: &str = "limits.yaml";

/// Options of the comparison; the command line overrides the limits file.
pub(super) fn choices(args: &CompareArgs) -> Result<ComparisonOptions, Failure> {
    if args.sequential && args.skins.len() != 2 {
        return Err(Failure::input(format!(
            "--sequential: expected 2 skins, found {}\n  next: compare them two at a time",
            args.skins.len()
        )));
    }
    let named = args.limits.as_deref();
    let file = named.or_else(|| Some(Path::new(FILE)).filter(|p| p.is_file()));
    let read = file.map(|path| {
        let name = path.display().to_string();
        let bytes = crate::paths::read_input(path, "name a limits file with --limits")?;
        Limits::parse(&name, &bytes).map_err(|found| Failure::findings(&found))
    });
    let mut limits = read.transpose()?.unwrap_or(Limits {
        file_name: String::new(),
        sha256: String::new(),
        name: String::new(),
        within_mm: None,
        margins: Vec::new(),
    });
    for margin in &args.margins {
        limits.set(*margin);
    }
    let margins = Metric::ALL.into_iter().filter_map(|metric| {
        let found = limits.margins.iter().find(|m| m.metric == metric.key())?;
        Some((metric, metric.margin(found.value)))
    });
    Ok(ComparisonOptions {
        margins: margins.collect(),
        limits: (!limits.name.is_empty()).then(|| limits.name.clone()),
        within_mm: args.within.or(limits.within_mm),
        overrides: args.despite.clone(),
        sequential: args.sequential.then_some(AlphaSpending {
            planned_looks: args.looks,
        }),
        ..ComparisonOptions::default()
    })
}
