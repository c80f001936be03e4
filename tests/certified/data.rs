//! Checks the data: they are what the generator writes, enough problems of every level, and equal in both formats.

use std::process::Command;

use serde_json::Value;

use crate::problem::{family, folder};
use crate::table::FAMILIES;

/// Greatest size of all files, bytes.
const MOST_BYTES: u64 = 400_000;

#[test]
fn the_files_are_those_that_both_methods_write() {
    let python = std::env::var("SKINRIG_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let run = |arguments: &[&str]| {
        let mut command = Command::new(&python);
        command.env("PYTHONDONTWRITEBYTECODE", "1");
        command.current_dir(folder()).args(arguments).output()
    };
    if !run(&["-c", "import mpmath"]).is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: no Python with mpmath");
        return;
    }
    let checked = run(&["make/generate.py", "data", "--check"]).unwrap();
    let said = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{said}");
}

#[test]
fn there_are_enough_problems_of_every_level_with_enough_digits() {
    let (mut problems, mut refused) = (0, 0);
    let mut levels = [0; 3];
    for name in FAMILIES {
        let mut names: Vec<String> = Vec::new();
        for problem in family(name).problems {
            problems += 1;
            refused += usize::from(problem.answers.is_empty());
            let level = ["easy", "average", "hard"]
                .iter()
                .position(|l| *l == problem.level);
            levels[level.unwrap()] += 1;
            for answer in &problem.answers {
                let value: f64 = answer.value.parse().unwrap();
                assert!(value.is_finite() && answer.condition >= 0.0);
            }
            names.push(problem.name);
        }
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count, "{name}: equal names");
    }
    assert!(problems >= 100, "{problems}");
    assert!(refused >= 15, "{refused}");
    assert!(levels.iter().all(|l| *l >= 20), "{levels:?}");
}

/// Values of nested lists and objects, as in `inputs.csv`.
fn flat(value: &Value, path: &str, into: &mut Vec<(String, Value)>) {
    let below = |key: &str| {
        if path.is_empty() {
            key.to_owned()
        } else {
            format!("{path}.{key}")
        }
    };
    match value {
        Value::Object(object) => object.iter().for_each(|(k, v)| flat(v, &below(k), into)),
        Value::Array(array) => {
            for (i, v) in array.iter().enumerate() {
                flat(v, &below(&i.to_string()), into);
            }
        }
        other => into.push((path.to_owned(), other.clone())),
    }
}

#[test]
fn both_formats_hold_the_same() {
    let read = |name: &str| std::fs::read_to_string(folder().join("data").join(name)).unwrap();
    let (inputs, answers) = (read("inputs.csv"), read("answers.csv"));
    let mut found = inputs.lines().skip(1);
    let mut certified = answers.lines().skip(1);
    for name in FAMILIES {
        for problem in family(name).problems {
            let mut all = Vec::new();
            flat(&problem.inputs, "", &mut all);
            let mut rows: Vec<(String, Value)> = Vec::new();
            for _ in 0..all.len() {
                let cells: Vec<&str> = found.next().unwrap().split(',').collect();
                assert_eq!(cells[..2], [name, problem.name.as_str()]);
                let word = || Value::String(cells[3].to_owned());
                let value = serde_json::from_str(cells[3]).unwrap_or_else(|_| word());
                rows.push((cells[2].to_owned(), value));
            }
            // The JSON reader sorts keys.
            rows.sort_by(|a, b| a.0.cmp(&b.0));
            all.sort_by(|a, b| a.0.cmp(&b.0));
            assert_eq!(rows, all, "{name}, {}", problem.name);
            let head = format!(
                "{name},{},{},{}",
                problem.name, problem.level, problem.outcome
            );
            if problem.answers.is_empty() {
                assert_eq!(certified.next().unwrap(), format!("{head},,,,"));
            }
            for answer in &problem.answers {
                let row = certified.next().unwrap();
                assert!(
                    row.starts_with(&format!("{head},{},", answer.quantity)),
                    "{row}"
                );
                assert!(row.contains(&format!(",{},", answer.value)), "{row}");
            }
        }
    }
    assert_eq!((found.next(), certified.next()), (None, None));
}

#[test]
fn the_files_are_small() {
    let folder = std::fs::read_dir(folder().join("data")).unwrap();
    let bytes: u64 = folder.map(|f| f.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < MOST_BYTES, "{bytes}");
}
