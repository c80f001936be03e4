//! Every figure of an analysis by its path, and the comparison of two analyses figure by figure.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::Value;
use skinrig_analysis::Analysis;
use skinrig_analysis::result::PicturePixel;
use skinrig_model::Point2;
use skinrig_model::skin::polygon_area_mm2;

/// A number or a word.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Figure {
    Number(f64),
    Word(String),
}

/// Figures by path, such as `scored.rmse_mm.value` and `presses[17].views[0].events`.
pub(crate) type Figures = BTreeMap<String, Figure>;

/// All figures, without what the input states itself.
pub(crate) fn figures(analysis: &Analysis) -> Figures {
    let mut out = Figures::new();
    let json = serde_json::to_value(analysis).unwrap();
    for (key, value) in json.as_object().unwrap() {
        if key != "settings" && key != "rig" {
            flatten(key, value, &mut out);
        }
    }
    out
}

fn flatten(path: &str, value: &Value, out: &mut Figures) {
    if let Some(figures) = without_order(path, value) {
        let figures = figures.into_iter();
        let named = figures.map(|(name, n)| (format!("{path}.{name}"), Figure::Number(n)));
        return out.extend(named);
    }
    let figure = match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                flatten(&format!("{path}.{key}"), value, out);
            }
            return;
        }
        Value::Array(items) => {
            out.insert(format!("{path}.len"), Figure::Number(items.len() as f64));
            for (i, value) in items.iter().enumerate() {
                flatten(&format!("{path}[{i}]"), value, out);
            }
            return;
        }
        Value::Number(n) => Figure::Number(n.as_f64().unwrap()),
        Value::String(word) => Figure::Word(word.clone()),
        Value::Bool(is) => Figure::Word(is.to_string()),
        Value::Null => Figure::Word("none".to_owned()),
    };
    out.insert(path.to_owned(), figure);
}

/// Figures that do not depend on the corners that describe an area, the order of pixels, or the half turn of an ellipse.
fn without_order(path: &str, value: &Value) -> Option<Vec<(String, f64)>> {
    let named = |name: &str, n: f64| (name.to_owned(), n);
    match kind(path).as_str() {
        "coverage.views[][]" | "coverage.overlap[]" => {
            let corners: Vec<Point2> = serde_json::from_value(value.clone()).unwrap();
            Some(vec![named("area_mm2", polygon_area_mm2(&corners))])
        }
        "pictures[].pixels" => {
            let pixels: Vec<PicturePixel> = serde_json::from_value(value.clone()).unwrap();
            let each = pixels.iter().flat_map(|p| {
                let place = |name: &str| format!("v{}u{}.{name}", p.v, p.u);
                [
                    (place("on"), f64::from(p.on)),
                    (place("off"), f64::from(p.off)),
                    (place("clustered"), f64::from(u8::from(p.clustered))),
                ]
            });
            Some(each.collect())
        }
        "presses[].region.angle_deg" => {
            let twice = 2.0 * value.as_f64()?.to_radians();
            Some(vec![
                named("cos_twice", libm::cos(twice)),
                named("sin_twice", libm::sin(twice)),
            ])
        }
        _ => None,
    }
}

/// The path without indices: `presses[].views[].events`.
pub(crate) fn kind(path: &str) -> String {
    let mut out = String::new();
    let mut inside = false;
    for c in path.chars() {
        inside = (inside || c == '[') && c != ']';
        if !inside || c == '[' {
            out.push(c);
        }
    }
    out
}

/// Figures at these kinds of path, given as beginnings, have only so many digits in common.
pub(crate) type Digits<'a> = &'a [(&'a str, f64)];

/// Digits that figures have in common unless stated otherwise.
const COMMON: f64 = 9.0;

/// Decimal digits that two figures have in common; infinite for equal ones. Numbers below 1 in their unit (mm, px, s) count
/// as 1, because a bias of 0 has no relative accuracy.
pub(crate) fn digits(a: &Figure, b: &Figure) -> f64 {
    match (a, b) {
        _ if a == b => f64::INFINITY,
        (Figure::Number(a), Figure::Number(b)) => {
            let size = a.abs().max(b.abs()).max(1.0);
            -libm::log10((a - b).abs() / size)
        }
        _ => f64::NEG_INFINITY,
    }
}

/// What a comparison found.
pub(crate) struct Comparison {
    pub figures: usize,
    pub equal: usize,
    /// Path, expected, found and digits in common of figures that differ by more than they may, worst first.
    pub broken: Vec<(String, String, String, f64)>,
    /// The figure with the fewest digits in common among those that hold.
    pub least: Option<(String, f64)>,
}

/// Compares what a relation demands with what was found.
pub(crate) fn compare(expected: &Figures, found: &Figures, rules: Digits<'_>) -> Comparison {
    let mut out = Comparison {
        figures: 0,
        equal: 0,
        broken: Vec::new(),
        least: None,
    };
    let paths: std::collections::BTreeSet<_> = expected.keys().chain(found.keys()).collect();
    for path in paths {
        out.figures += 1;
        let kind = kind(path);
        let rule = rules.iter().find(|(start, _)| kind.starts_with(start));
        let needed = rule.map_or(COMMON, |r| r.1);
        let pair = (expected.get(path), found.get(path));
        let common = match pair {
            (Some(a), Some(b)) => digits(a, b),
            _ => f64::NEG_INFINITY,
        };
        if common == f64::INFINITY {
            out.equal += 1;
        } else if common.is_nan() || common < needed {
            let text = |f: Option<&Figure>| match f {
                Some(Figure::Number(n)) => format!("{n:?}"),
                Some(Figure::Word(w)) => w.clone(),
                None => "absent".to_owned(),
            };
            let row = (path.clone(), text(pair.0), text(pair.1), common);
            out.broken.push(row);
        } else if out.least.as_ref().is_none_or(|(_, least)| common < *least) {
            out.least = Some((path.clone(), common));
        }
    }
    out.broken.sort_by(|a, b| a.3.total_cmp(&b.3));
    out
}

impl Comparison {
    /// The broken figures, one per kind of path and line, with the number of its kind.
    pub(crate) fn report(&self) -> String {
        let mut kinds: Vec<(String, usize, usize)> = Vec::new();
        for (i, (path, ..)) in self.broken.iter().enumerate() {
            let kind = kind(path);
            match kinds.iter_mut().find(|k| k.0 == kind) {
                Some(known) => known.2 += 1,
                None => kinds.push((kind, i, 1)),
            }
        }
        let mut out = format!("{} of {} figures differ", self.broken.len(), self.figures);
        for (_, i, count) in kinds {
            let (path, expected, found, digits) = &self.broken[i];
            let others = count - 1;
            let _ = write!(
                out,
                "\n  {path}: expected {expected}, found {found} ({digits:.1} digits; {others} more of its kind)"
            );
        }
        out
    }
}
