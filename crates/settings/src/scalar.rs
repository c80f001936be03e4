//! Reads one value: a word, a number, a quantity or numbered items. Reports what is expected instead.

use crate::diagnostic::{Collector, did_you_mean};
use crate::field::Value;
use crate::quantity::{self, Dimension};
use crate::range::ValueRange;
use crate::shape::{Shape, Word};
use crate::wording::expectation;
use crate::yaml::{Kind, Node, join, quote};

pub(crate) fn choice(
    text: &str,
    words: &'static [Word],
    shape: &'static Shape,
    node: &Node,
    path: &str,
    out: &mut Collector,
) -> Option<Value> {
    if let Some((word, _)) = words.iter().find(|(word, _)| *word == text) {
        return Some(Value::Word(word));
    }
    out.error(node.span, path, "unknown word")
        .expected(expectation(shape))
        .found(quote(text))
        .maybe_help(did_you_mean(text, words.iter().map(|(word, _)| *word)));
    None
}

pub(crate) fn whole(
    text: &str,
    plain: bool,
    min: i64,
    max: i64,
    node: &Node,
    path: &str,
    out: &mut Collector,
) -> Option<Value> {
    let expected = expectation(&Shape::Whole { min, max });
    match text.parse::<i64>() {
        Ok(n) if plain && (min..=max).contains(&n) => return Some(Value::Whole(n)),
        Ok(_) if plain => out
            .error(node.span, path, "the number is out of range")
            .expected(expected)
            .found(quote(text)),
        Ok(_) => out
            .error(node.span, path, "a text instead of a number")
            .expected(expected)
            .found(format!("\"{text}\""))
            .help("remove the quotes"),
        Err(_) => {
            let is_unit = |rest: &str| {
                !rest.is_empty()
                    && rest
                        .chars()
                        .all(|c| c.is_alphabetic() || "%/°²".contains(c))
            };
            let help = match quantity::split_number(text) {
                (Some(n), rest) if is_unit(rest.trim()) && n.fract() == 0.0 => {
                    Some(format!("counts have no unit: write `{n}`"))
                }
                _ => None,
            };
            out.error(node.span, path, "not a whole number")
                .expected(expected)
                .found(quote(text))
                .maybe_help(help)
        }
    };
    None
}

pub(crate) fn number(
    text: &str,
    range: &ValueRange,
    node: &Node,
    path: &str,
    out: &mut Collector,
) -> Option<Value> {
    match quantity::split_number(text) {
        (Some(n), "") if range.contains(n) => return Some(Value::Number(n)),
        (Some(n), "") => out
            .error(node.span, path, "the number is out of range")
            .expected(range.describe(""))
            .found(format!("`{n}`")),
        _ => out
            .error(node.span, path, "not a number")
            .expected(format!("a number without a unit, {}", range.describe("")))
            .found(quote(text)),
    };
    None
}

pub(crate) fn measured(
    text: &str,
    dimensions: &[Dimension],
    range: &ValueRange,
    node: &Node,
    path: &str,
    out: &mut Collector,
) -> Option<Value> {
    match quantity::parse(text, dimensions) {
        Ok(q) if range.contains(q.value) => return Some(Value::Quantity(q.value, q.dimension)),
        Ok(q) => {
            out.error(node.span, path, "the value is out of range")
                .expected(range.describe(q.dimension.usual_unit()))
                .found(quote(text));
        }
        Err(e) => {
            out.error(node.span, path, e.message)
                .expected(e.expected)
                .found(e.found)
                .maybe_help(e.help);
        }
    }
    None
}

/// Numbers from 1 and spans such as `2-10`.
pub(crate) fn numbers(items: &[Node], path: &str, out: &mut Collector) -> Option<Value> {
    let mut values = Vec::new();
    let mut clean = true;
    for (i, item) in items.iter().enumerate() {
        let Kind::Scalar { text, .. } = &item.kind else {
            out.error(
                item.span,
                join(path, &format!("[{i}]")),
                "the value has the wrong form",
            )
            .expected(expectation(&Shape::Numbers))
            .found(item.describe());
            clean = false;
            continue;
        };
        let parse = |t: &str| t.trim().parse::<u32>().ok().filter(|n| *n >= 1);
        let span = match text.split_once('-') {
            Some((a, b)) => parse(a).zip(parse(b)).filter(|(a, b)| a <= b),
            None => parse(text).map(|n| (n, n)),
        };
        match span {
            Some((a, b)) => values.push((a, b, item.span)),
            None => {
                let backwards = text
                    .split_once('-')
                    .and_then(|(a, b)| parse(a).zip(parse(b)))
                    .map(|(a, b)| format!("the span runs backwards: write `{b}-{a}`"));
                let help = (text == "0")
                    .then(|| "counting starts at 1".to_owned())
                    .or(backwards);
                out.error(
                    item.span,
                    join(path, &format!("[{i}]")),
                    "not a number or span of numbers",
                )
                .expected(expectation(&Shape::Numbers))
                .found(quote(text))
                .maybe_help(help);
                clean = false;
            }
        }
    }
    clean.then_some(Value::Numbers(values))
}
