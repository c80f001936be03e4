//! Reads a table of estimates: one row for every scored press of the challenge.

use std::collections::BTreeMap;

use csv::StringRecord;
use skinrig_analysis::result::Region;
use skinrig_model::SkinOutline;

use super::error::EstimateError;

/// Columns that every table has.
const COLUMNS: [&str; 3] = ["press", "x_mm", "y_mm"];
/// Columns of regions: all or none.
const REGION: [&str; 3] = ["region_major_mm", "region_minor_mm", "region_angle_deg"];
/// A table whose positions are all nearer to zero than this share of the skin's diagonal is not in mm.
const TINY: f64 = 0.01;

/// An estimate with its region, if the table has regions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Estimate, mm.
    pub at: [f64; 2],
    /// Its 95 % region.
    pub region: Option<Region>,
}

/// The estimates of a table, by press; `None`: not located.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimates {
    /// By number in the challenge.
    pub presses: BTreeMap<u32, Option<Position>>,
    /// True if the table states regions.
    pub has_regions: bool,
}

struct Columns {
    required: [usize; 3],
    region: Option<[usize; 3]>,
}

impl Columns {
    fn of(header: &StringRecord) -> Result<Self, EstimateError> {
        let names: Vec<&str> = header.iter().map(str::trim).collect();
        for (i, name) in names.iter().enumerate() {
            let known = COLUMNS.contains(name) || REGION.contains(name);
            if !known || names[..i].contains(name) {
                return Err(EstimateError::UnknownColumn {
                    column: (*name).to_owned(),
                });
            }
        }
        let find = |column: &'static str| {
            let at = names.iter().position(|name| *name == column);
            at.ok_or_else(|| EstimateError::NoColumn {
                column,
                found: names.iter().map(|name| (*name).to_owned()).collect(),
            })
        };
        let all = |[a, b, c]: [&'static str; 3]| Ok([find(a)?, find(b)?, find(c)?]);
        let regions = names.iter().any(|name| REGION.contains(name));
        Ok(Self {
            required: all(COLUMNS)?,
            region: regions.then(|| all(REGION)).transpose()?,
        })
    }
}

/// A row of the table.
struct Row<'a> {
    number: u64,
    cells: &'a StringRecord,
}

impl Row<'_> {
    fn cell(&self, at: usize) -> &str {
        self.cells.get(at).unwrap_or_default().trim()
    }

    fn number(&self, at: usize, column: &'static str) -> Result<f64, EstimateError> {
        let cell = self.cell(at);
        if cell.is_empty() {
            return Err(EstimateError::Empty {
                row: self.number,
                column,
            });
        }
        let value = cell.parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| EstimateError::NotANumber {
            row: self.number,
            column,
            found: cell.to_owned(),
        })
    }

    fn press(&self, at: usize) -> Result<u32, EstimateError> {
        // Tables with an empty cell write whole numbers as 1.0.
        let value = self.cell(at).parse::<f64>().ok();
        let whole = value.filter(|v| v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(v));
        whole
            .map(|v| v as u32)
            .ok_or_else(|| EstimateError::NotAPress {
                row: self.number,
                found: self.cell(at).to_owned(),
            })
    }

    /// `None` if all cells of the position and the region are empty.
    fn position(&self, columns: &Columns) -> Result<Option<Position>, EstimateError> {
        let [_, x, y] = columns.required;
        let cells = [x, y]
            .into_iter()
            .chain(columns.region.into_iter().flatten());
        if cells.into_iter().all(|at| self.cell(at).is_empty()) {
            return Ok(None);
        }
        let at = [self.number(x, COLUMNS[1])?, self.number(y, COLUMNS[2])?];
        let region = match columns.region {
            None => None,
            Some([major, minor, angle]) => Some(Region {
                semi_axes_mm: self.semi_axes_mm(major, minor)?,
                angle_deg: self.number(angle, REGION[2])?,
            }),
        };
        Ok(Some(Position { at, region }))
    }

    /// The longer semi-axis, then the shorter one.
    fn semi_axes_mm(&self, major: usize, minor: usize) -> Result<[f64; 2], EstimateError> {
        let [major_mm, minor_mm] = [
            self.length(major, REGION[0])?,
            self.length(minor, REGION[1])?,
        ];
        if minor_mm > major_mm {
            return Err(EstimateError::AxesExchanged {
                row: self.number,
                major_mm,
                minor_mm,
            });
        }
        Ok([major_mm, minor_mm])
    }

    fn length(&self, at: usize, column: &'static str) -> Result<f64, EstimateError> {
        let found = self.number(at, column)?;
        if found > 0.0 {
            return Ok(found);
        }
        Err(EstimateError::SemiAxis {
            row: self.number,
            column,
            found,
        })
    }
}

impl Estimates {
    /// Reads the table. `scored`: numbers of the presses to locate; `calibrating`: of those whose position is given.
    ///
    /// # Errors
    /// [`EstimateError`] for the first row that is wrong.
    pub fn read(
        table: impl std::io::Read,
        scored: &[u32],
        calibrating: &[u32],
        outline: &SkinOutline,
    ) -> Result<Self, EstimateError> {
        let mut reader = csv::Reader::from_reader(table);
        let broken = |e: csv::Error| EstimateError::Csv {
            row: e.position().map_or(1, csv::Position::line),
            found: e.to_string(),
        };
        let columns = Columns::of(reader.headers().map_err(broken)?)?;
        let mut rows: BTreeMap<u32, u64> = BTreeMap::new();
        let mut presses = BTreeMap::new();
        let mut last = 1;
        for cells in reader.records() {
            let cells = cells.map_err(broken)?;
            let number = cells.position().map_or(last + 1, csv::Position::line);
            let row = Row {
                number,
                cells: &cells,
            };
            last = number;
            let press = row.press(columns.required[0])?;
            if calibrating.contains(&press) {
                return Err(EstimateError::CalibrationPress { row: number, press });
            }
            if !scored.contains(&press) {
                return Err(EstimateError::UnknownPress { row: number, press });
            }
            if let Some(first) = rows.insert(press, number) {
                return Err(EstimateError::Duplicate {
                    row: number,
                    first,
                    press,
                });
            }
            presses.insert(press, row.position(&columns)?);
        }
        let missing: Vec<u32> = scored
            .iter()
            .copied()
            .filter(|press| !presses.contains_key(press))
            .collect();
        if let [first, ..] = missing[..] {
            return Err(EstimateError::Missing {
                count: missing.len(),
                first,
                row: last,
            });
        }
        let estimates = Self {
            presses,
            has_regions: columns.region.is_some(),
        };
        match estimates.implausible(outline) {
            None => Ok(estimates),
            Some(Implausible::FarAway {
                press,
                at,
                away_mm,
                most_mm,
            }) => Err(EstimateError::FarAway {
                row: rows.get(&press).copied().unwrap_or(last),
                x_mm: at[0],
                y_mm: at[1],
                away_mm,
                most_mm,
            }),
            Some(Implausible::Tiny { extent_mm }) => Err(EstimateError::Tiny {
                row: last,
                extent_mm,
            }),
        }
    }

    /// The first sign that the positions are not in mm in the skin frame.
    pub(super) fn implausible(&self, outline: &SkinOutline) -> Option<Implausible> {
        let (centre, most_mm) = (outline.centre, outline.diagonal_mm());
        let mut extent_mm: Option<f64> = None;
        for (press, position) in &self.presses {
            let Some(Position { at: [x, y], .. }) = position else {
                continue;
            };
            let away_mm = libm::hypot(x - centre.x_mm, y - centre.y_mm);
            if away_mm > most_mm {
                return Some(Implausible::FarAway {
                    press: *press,
                    at: [*x, *y],
                    away_mm,
                    most_mm,
                });
            }
            extent_mm = Some(extent_mm.unwrap_or(0.0).max(libm::hypot(*x, *y)));
        }
        let extent_mm = extent_mm.filter(|extent| *extent < TINY * most_mm)?;
        Some(Implausible::Tiny { extent_mm })
    }
}

/// Positions in pixels, metres or another frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Implausible {
    /// A position is far from the skin.
    FarAway {
        press: u32,
        at: [f64; 2],
        away_mm: f64,
        most_mm: f64,
    },
    /// All positions together are near zero.
    Tiny { extent_mm: f64 },
}
