//! Press-position tables: units, blank rows, and every kind of bad cell.

use std::path::Path;

use proptest::prelude::*;
use skinrig_formats::positions::{LengthUnit, PositionTable};

fn parse(text: &str) -> Result<PositionTable, String> {
    PositionTable::parse(text.as_bytes(), Path::new("p.csv"), LengthUnit::Metre)
        .map_err(|e| e.to_string())
}

#[test]
fn metres_become_millimetres_and_the_blank_end_is_reported() {
    let table = parse("x,y,z\n-0.022,-0.03,-0.002\n0.042,0.034,-0.002\n,,\n").unwrap();
    assert_eq!(table.presses.len(), 2);
    let first = table.presses[0];
    assert!((first.x_mm + 22.0).abs() < 1e-12 && (first.y_mm + 30.0).abs() < 1e-12);
    assert_eq!(first.z_mm, Some(-2.0));
    assert_eq!((first.line, table.presses[1].line), (2, 3));
    assert_eq!(table.blank_lines, [4]);
    assert!(table.other_columns.is_empty());
}

#[test]
fn columns_are_found_by_name_and_the_rest_is_listed() {
    let text = "label, y ,x\r\na,2,1\r\nb,4,3\r\n\r\n";
    let table = PositionTable::parse(text.as_bytes(), Path::new("p"), LengthUnit::Millimetre);
    let table = table.unwrap();
    let found: Vec<_> = table
        .presses
        .iter()
        .map(|p| (p.x_mm, p.y_mm, p.z_mm))
        .collect();
    assert_eq!(found, [(1.0, 2.0, None), (3.0, 4.0, None)]);
    assert_eq!(table.other_columns, ["label"]);
    assert_eq!(table.blank_lines, [4]);
}

#[test]
fn bad_tables_are_rejected_with_file_and_line() {
    for (text, expected) in [
        ("", "p.csv:1: expected a column `x`, found columns "),
        (
            "x;y\n1;2\n",
            "p.csv:1: expected a column `x`, found columns x;y",
        ),
        (
            "x,z\n1,2\n",
            "p.csv:1: expected a column `y`, found columns x, z",
        ),
        (
            "x,y,x\n1,2,3\n",
            "p.csv:1: expected one column `x`, found two",
        ),
        ("x,y\n", "p.csv:2: expected at least one press, found none"),
        (
            "x,y\n,\n",
            "p.csv:2: expected at least one press, found none",
        ),
        ("x,y\n1,2\n3\n", "p.csv:3: expected 2 cells, found 1"),
        ("x,y\n1,2,3\n", "p.csv:2: expected 2 cells, found 3"),
        (
            "x,y\n1,nan\n",
            "p.csv:2: expected a number in -10..=10 as y, found `nan`",
        ),
        (
            "x,y\ninf,1\n",
            "p.csv:2: expected a number in -10..=10 as x, found `inf`",
        ),
        ("x,y\n1,two\n", "as y, found `two`"),
        (
            "x,y\n1,\n",
            "p.csv:2: expected a number in -10..=10 as y, found ``",
        ),
        (
            "x,y,z\n1,2,\n",
            "p.csv:2: expected a number in -10..=10 as z, found ``",
        ),
        (
            "x,y\n22,30\n",
            "p.csv:2: expected a number in -10..=10 as x, found `22`",
        ),
        (
            "x,y\n1,2\n,\n3,4\n",
            "p.csv:3: expected blank rows only after the last press, found a blank row, and a press at \
             line 4",
        ),
        (
            "x,y\n1,2\n\n3,4\n",
            "p.csv:3: expected blank rows only after the last press",
        ),
    ] {
        let error = parse(text).unwrap_err();
        assert!(error.contains(expected), "{text:?}: {error}");
    }
    let latin = PositionTable::parse(&b"x,y\n1,\xff\n"[..], Path::new("p.csv"), LengthUnit::Metre);
    let latin = latin.unwrap_err().to_string();
    assert!(
        latin.starts_with("p.csv:2: expected a table in UTF-8"),
        "{latin}"
    );
}

proptest! {
    #[test]
    fn any_bytes_give_a_table_or_an_error(
        bytes in prop::collection::vec(any::<u8>(), 0..200),
        text in "x,y(,z)?\n[0-9,.\n\"e-]{0,60}",
    ) {
        let _ = PositionTable::parse(&bytes[..], Path::new("p"), LengthUnit::Metre);
        let _ = parse(&text);
    }
}
