//! `.bias` files: one line per bias, `<mV> % <name>`, as the public tools read and write them.

use super::{BIASES, Values, complete, named};
use crate::error::Evk1Error;

/// Parses a bias file. Checks every value against its range and all interlocks. Biases that are not in the file keep their defaults;
/// empty lines are skipped.
///
/// # Errors
/// [`Evk1Error::BiasFile`] with the line; [`Evk1Error::Refused`] for a broken interlock.
pub fn parse_bias_file(text: &str) -> Result<Values, Evk1Error> {
    let mut values = Values::new();
    for (n, line) in text.lines().enumerate() {
        let fault = |expected: &str, found: String| Evk1Error::BiasFile {
            line: n + 1,
            expected: expected.to_owned(),
            found,
        };
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let quoted = || format!("`{line}`");
        let Some((value, name)) = line.split_once('%') else {
            return Err(fault("`<mV> % <name>`", quoted()));
        };
        let (value, name) = (value.trim(), name.trim());
        let mv: i64 = value
            .parse()
            .map_err(|_| fault("a whole number of mV before the `%`", format!("`{value}`")))?;
        let Some(bias) = named(name) else {
            let names = BIASES.map(|b| b.name).join(", ");
            return Err(fault(
                &format!("a bias out of {names}"),
                format!("`{name}`"),
            ));
        };
        bias.encode(mv).map_err(|e| match e {
            Evk1Error::Refused { expected, found } => fault(&expected, found),
            other => other,
        })?;
        if values.insert(name.to_owned(), mv).is_some() {
            return Err(fault("every bias once", format!("{name} again")));
        }
    }
    if values.is_empty() {
        return Err(Evk1Error::BiasFile {
            line: text.lines().count() + 1,
            expected: "lines of `<mV> % <name>`".to_owned(),
            found: "none".to_owned(),
        });
    }
    complete(&values)
}

/// Formats a bias file with all biases.
///
/// # Errors
/// [`Evk1Error::Refused`] for invalid values.
pub fn write_bias_file(values: &Values) -> Result<String, Evk1Error> {
    let values = complete(values)?;
    Ok(BIASES
        .iter()
        .filter_map(|b| values.get(b.name).map(|mv| format!("{mv} % {}\n", b.name)))
        .collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn faults_name_their_line() {
        let faults = [
            "",
            "299 % bias_diff\n\n384 bias_diff_on\n",
            "38.4 % bias_diff_on",
            "384 % bias_on",
            "1 % bias_fo",
            "1477 % bias_fo\r\n1478 % bias_fo\r\n",
            "373 % bias_diff_on",
        ];
        let errors: Vec<String> = faults
            .into_iter()
            .map(|text| parse_bias_file(text).unwrap_err().to_string())
            .collect();
        insta::assert_snapshot!(errors.join("\n"), @r"
bias file, line 1: expected lines of `<mV> % <name>`, found none
bias file, line 3: expected `<mV> % <name>`, found `384 bias_diff_on`
bias file, line 1: expected a whole number of mV before the `%`, found `38.4`
bias file, line 1: expected a bias out of bias_diff, bias_diff_off, bias_diff_on, bias_fo, bias_hpf, bias_pr, bias_refr, found `bias_on`
bias file, line 1: expected bias_fo in 1250..=1800 mV, found 1 mV
bias file, line 2: expected every bias once, found bias_fo again
expected bias_diff_on >= bias_diff + 75 = 374 mV with bias_diff 299 mV and bias_fo 1477 mV (not below 1350), found 373 mV
");
    }

    proptest! {
        #[test]
        fn written_biases_read_back(on in 394..=1800_i64, off in 0..=214_i64, fo in 1250..=1800_i64, pr in 975..=1800_i64) {
            let requested: Values = [("bias_diff_on", on), ("bias_diff_off", off), ("bias_fo", fo), ("bias_pr", pr)]
                .map(|(n, v)| (n.to_owned(), v))
                .into();
            let text = write_bias_file(&requested).unwrap();
            prop_assert_eq!(parse_bias_file(&text).unwrap(), complete(&requested).unwrap());
        }

        #[test]
        fn any_text_gives_values_or_an_error(text in "[0-9%a-z_ \n-]{0,60}") {
            let _ = parse_bias_file(&text);
        }
    }
}
