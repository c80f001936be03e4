//! `skinrig catalogue query`: prints questions and answers.

use skinrig_catalogue::{Access, Answer, Catalogue, Parameter, Question, Value};
use skinrig_text::{Column, LongWords, Table, hang, widest};

use super::args::QueryArgs;
use super::failure::{WAIT, failure};
use crate::exit::{Exit, Outcome};

/// Widest column, characters; identifiers have 32.
const MOST_WIDTH: usize = 40;

/// Answers a question, or lists all questions.
pub(super) fn query(args: &QueryArgs, json: bool) -> Outcome {
    let Some(question) = args.name else {
        print_questions(json);
        return Ok(Exit::Ok);
    };
    let address = args.catalogue.of_folder(&args.folder);
    let mut catalogue = Catalogue::open(address, Access::Read, WAIT).map_err(failure)?;
    let answer = catalogue.ask(question, &args.parameters).map_err(failure)?;
    let stale = match args.folder.is_dir() {
        true => catalogue.status(&args.folder).map_err(failure)?.stale.len(),
        false => 0,
    };
    catalogue.close().map_err(failure)?;
    if stale > 0 {
        errln!(
            "note: {stale} sessions of {0} are not in the catalogue as they are; `skinrig catalogue register {0}` reads them",
            args.folder.display()
        );
    }
    if json {
        crate::terminal::print_json(&document(&answer, stale));
    } else {
        print_answer(&answer);
    }
    Ok(Exit::Ok)
}

/// Rows as objects, and how many sessions of the folder are not in the catalogue as they are.
fn document(answer: &Answer, stale: usize) -> serde_json::Value {
    let row = |row: &Vec<Value>| {
        let cells = answer.columns.iter().cloned().zip(row);
        let cells = cells.map(|(name, value)| (name, serde_json::json!(value)));
        serde_json::Value::Object(cells.collect())
    };
    let parameters = answer.parameters.iter();
    let parameters = parameters.map(|(name, value)| ((*name).to_owned(), value.as_str().into()));
    serde_json::json!({
        "question": answer.question,
        "parameters": serde_json::Value::Object(parameters.collect()),
        "rows": answer.rows.iter().map(row).collect::<Vec<_>>(),
        "stale_sessions": stale,
    })
}

fn print_answer(answer: &Answer) {
    if answer.rows.is_empty() {
        outln!("no rows");
        return;
    }
    let rows: Vec<Vec<String>> = answer
        .rows
        .iter()
        .map(|r| r.iter().map(cell).collect())
        .collect();
    let columns = answer.columns.iter().enumerate().map(|(at, name)| {
        let cells = rows.iter().map(|row| row[at].as_str());
        let width = widest(cells.chain([name.as_str()])).min(MOST_WIDTH);
        let is_number = |row: &Vec<Value>| !matches!(row[at], Value::Text(_));
        match answer.rows.iter().all(is_number) {
            true => Column::right(width),
            false => Column::left(width).clipped(),
        }
    });
    let table = Table::new(columns.collect::<Vec<_>>());
    outln!("{}", table.row(&answer.columns).trim_end());
    for row in &rows {
        outln!("{}", table.row(row).trim_end());
    }
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::Integer(value) => value.to_string(),
        Value::Real(value) if value.abs() >= 1e6 => format!("{value:.3e}"),
        Value::Real(value) => format!("{value:.4}"),
        Value::Text(text) => text.clone(),
    }
}

fn print_questions(json: bool) {
    let all = Question::all();
    if json {
        let parameter = |p: &Parameter| serde_json::json!({ "name": p.name, "value": p.kind.words(), "default": p.default });
        let question = |q: &Question| {
            let parameters: Vec<_> = q.parameters.iter().map(parameter).collect();
            serde_json::json!({ "name": q.name, "about": q.about, "parameters": parameters })
        };
        let all: Vec<_> = all.iter().map(question).collect();
        crate::terminal::print_json(&all.into());
        return;
    }
    let width = widest(all.iter().map(|q| q.name));
    for question in all {
        let parameter = |p: &Parameter| match p.default {
            Some(default) => format!("{}={default}", p.name),
            None => format!("{}=...", p.name),
        };
        let parameters: Vec<String> = question.parameters.iter().map(parameter).collect();
        let text = format!("{} {}", question.about, parameters.join(" "));
        let name = format!("{:width$}  ", question.name);
        crate::terminal::out(format_args!(
            "{}",
            hang(&name, text.trim_end(), LongWords::Keep)
        ));
    }
}
