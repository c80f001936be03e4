//! The sensor's biases: ranges, register codes, and interlocks.
//!
//! Source: OpenEB 3.1.2, `hal_psee_plugins/src/devices/gen31/gen31_ll_biases.cpp` and `biasgen/*.calib`.

mod file;
mod tables;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

pub use file::{parse_bias_file, write_bias_file};

use crate::access::Registers;
use crate::error::Evk1Error;
use crate::registers::{Register, bias_generator};

/// Type of a bias DAC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dac {
    Voltage,
    RailP,
    PThick,
    NThin,
}

/// One bias.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bias {
    /// Its name.
    pub name: &'static str,
    /// Allowed range, mV.
    pub range_mv: RangeInclusive<i64>,
    /// Its default, mV.
    pub default_mv: i64,
    generator: usize,
    dac: Dac,
}

const fn bias(
    name: &'static str,
    generator: usize,
    dac: Dac,
    range_mv: RangeInclusive<i64>,
    default_mv: i64,
) -> Bias {
    Bias {
        name,
        range_mv,
        default_mv,
        generator,
        dac,
    }
}

/// Reference of the two contrast thresholds, mV; fixed.
pub(crate) const DIFF: &str = "bias_diff";

/// All named biases in the order of a bias file. `bias_diff` accepts only its default.
pub const BIASES: [Bias; 7] = [
    bias(DIFF, 21, Dac::Voltage, 299..=299, 299),
    bias("bias_diff_off", 19, Dac::Voltage, 0..=1800, 221),
    bias("bias_diff_on", 20, Dac::Voltage, 0..=1800, 384),
    bias("bias_fo", 22, Dac::RailP, 1250..=1800, 1477),
    bias("bias_hpf", 25, Dac::PThick, 900..=1800, 1499),
    bias("bias_pr", 23, Dac::PThick, 975..=1800, 1250),
    bias("bias_refr", 24, Dac::NThin, 1300..=1800, 1500),
];

/// Values of all biases by name, mV.
pub type Values = BTreeMap<String, i64>;

/// The bias called `name`.
#[must_use]
pub fn named(name: &str) -> Option<&'static Bias> {
    const ALL: &[Bias] = &BIASES;
    ALL.iter().find(|b| b.name == name)
}

impl Bias {
    /// Its register.
    #[must_use]
    pub const fn register(&self) -> Register {
        bias_generator(self.generator)
    }

    /// The register's word for `mv`.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] outside the range.
    pub fn encode(&self, mv: i64) -> Result<u32, Evk1Error> {
        if !self.range_mv.contains(&mv) {
            let (low, high) = (self.range_mv.start(), self.range_mv.end());
            let range = if low == high {
                format!(
                    "{} of {low} mV, the fixed reference of the contrast thresholds",
                    self.name
                )
            } else {
                format!("{} in {low}..={high} mV", self.name)
            };
            return Err(Evk1Error::refused(range, format!("{mv} mV")));
        }
        Ok(match self.dac {
            Dac::Voltage => VOLTAGE | lowest_below(&tables::VOLTAGE_FROM_MV, mv) as u32,
            Dac::RailP => {
                let steps = tables::RAIL_P_FROM_MV.partition_point(|&from| from <= mv);
                RAIL_P | (127 - steps as u32) << 8
            }
            Dac::PThick => Self::p_thick(mv),
            Dac::NThin => P_PLAIN | code(&tables::N_THIN_CODES, tables::N_THIN_FIRST_MV, mv) << 8,
        })
    }

    fn p_thick(mv: i64) -> u32 {
        let mode = if mv < tables::P_THICK_NO_CASCODE_MV {
            P_CASCODE
        } else {
            P_PLAIN
        };
        mode | code(&tables::P_THICK_CODES, tables::P_THICK_FIRST_MV, mv) << 8
    }
}

/// Enabled, buffer 8; voltage DAC, no cascode, N.
const VOLTAGE: u32 = 0x7900_0000;
/// Enabled, buffer 8; current DAC, no cascode, N.
const RAIL_P: u32 = 0x7100_0000;
/// Enabled, buffer 8; current DAC, no cascode, P.
const P_PLAIN: u32 = 0x5100_0000;
/// Enabled, buffer 8; current DAC, cascode, P.
const P_CASCODE: u32 = 0x4100_0000;

/// Index of the last item that is at most `mv`; the first item always is.
fn lowest_below(thresholds: &[i64], mv: i64) -> usize {
    thresholds
        .partition_point(|&from| from <= mv)
        .saturating_sub(1)
}

/// Code of `mv` in a table that starts at `first_mv`; 0 beyond its end.
fn code(table: &[u16], first_mv: i64, mv: i64) -> u32 {
    let at = usize::try_from(mv - first_mv).ok();
    at.and_then(|at| table.get(at))
        .copied()
        .map_or(0, u32::from)
}

/// All biases: `requested` plus the defaults of the others.
///
/// # Errors
/// [`Evk1Error::Refused`] for an unknown name, a value out of range, or a broken interlock.
pub fn complete(requested: &Values) -> Result<Values, Evk1Error> {
    let mut values: Values = BIASES
        .iter()
        .map(|b| (b.name.to_owned(), b.default_mv))
        .collect();
    for (name, &mv) in requested {
        let Some(bias) = named(name) else {
            let names = BIASES.map(|b| b.name).join(", ");
            return Err(Evk1Error::refused(format!("a bias out of {names}"), name));
        };
        bias.encode(mv)?;
        values.insert(name.clone(), mv);
    }
    check_interlocks(&values)?;
    Ok(values)
}

/// Checks the rules between biases: the contrast thresholds keep a distance from the reference, a larger one while the pixel bandwidth
/// is high, and a high bandwidth requires a refractory bias above the minimum.
fn check_interlocks(values: &Values) -> Result<(), Evk1Error> {
    let of = |name: &str| values.get(name).copied().unwrap_or_default();
    let (diff, on, off) = (of(DIFF), of("bias_diff_on"), of("bias_diff_off"));
    let (fo, refr) = (of("bias_fo"), of("bias_refr"));
    let fast = fo < 1350;
    let (above, below) = if fast { (95, 85) } else { (75, 65) };
    let why = format!(
        "with bias_diff {diff} mV and bias_fo {fo} mV ({} 1350)",
        if fast { "below" } else { "not below" }
    );
    if on < diff + above {
        return Err(Evk1Error::refused(
            format!(
                "bias_diff_on >= bias_diff + {above} = {} mV {why}",
                diff + above
            ),
            format!("{on} mV"),
        ));
    }
    if off > diff - below {
        return Err(Evk1Error::refused(
            format!(
                "bias_diff_off <= bias_diff - {below} = {} mV {why}",
                diff - below
            ),
            format!("{off} mV"),
        ));
    }
    if fo < 1400 && refr < 1350 {
        return Err(Evk1Error::refused(
            format!("bias_refr >= 1350 mV with bias_fo {fo} mV (below 1400)"),
            format!("{refr} mV"),
        ));
    }
    Ok(())
}

/// Writes all biases, after [`complete`] has checked them. Writes `bias_fo` last when it falls and first when it rises, so that the
/// interlocks hold after every write.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn write(registers: &mut Registers<'_>, values: &Values) -> Result<(), Evk1Error> {
    let mut todo = Vec::new();
    for bias in &BIASES {
        if let Some(&mv) = values.get(bias.name) {
            todo.push((bias.register(), bias.encode(mv)?, bias.dac));
        }
    }
    // A higher code of this DAC is a lower voltage.
    let mut falls = false;
    for &(register, word, dac) in &todo {
        if dac == Dac::RailP {
            falls = word > registers.read(register)?;
        }
    }
    todo.sort_by_key(|&(.., dac)| (dac == Dac::RailP) == falls);
    for (register, word, _) in todo {
        registers.write(register, word)?;
    }
    Ok(())
}

/// Reads a bias: returns `mv` if the register has the word of that value, otherwise the word.
///
/// # Errors
/// [`Evk1Error::Usb`].
pub(crate) fn read_as(
    registers: &mut Registers<'_>,
    bias: &Bias,
    mv: i64,
) -> Result<String, Evk1Error> {
    let found = registers.read(bias.register())?;
    Ok(if bias.encode(mv) == Ok(found) {
        mv.to_string()
    } else {
        format!("register word {found:#010x}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(name: &str, mv: i64) -> u32 {
        named(name).unwrap().encode(mv).unwrap()
    }

    fn refusal(changes: &[(&str, i64)]) -> String {
        let requested = changes.iter().map(|&(n, v)| (n.to_owned(), v)).collect();
        complete(&requested).unwrap_err().to_string()
    }

    #[test]
    fn codes_are_those_of_the_calibration_tables() {
        // Defaults, equal to the constants that the sensor is initialised with.
        assert_eq!(word("bias_diff", 299), 0x7900_0029);
        assert_eq!(word("bias_diff_on", 384), 0x7900_0035);
        assert_eq!(word("bias_diff_off", 221), 0x7900_001e);
        assert_eq!(word("bias_fo", 1477), 0x7100_3d00);
        assert_eq!(word("bias_pr", 1250), 0x5103_4f00);
        assert_eq!(word("bias_refr", 1500), 0x5100_4f00);
        assert_eq!(word("bias_hpf", 1499), 0x5100_0100);
        // Ends and steps.
        assert_eq!(word("bias_diff_off", 0), 0x7900_0000);
        assert_eq!(word("bias_diff_on", 398), 0x7900_0037);
        assert_eq!(word("bias_diff_on", 1800), 0x7900_00ff);
        assert_eq!(word("bias_fo", 1250), 0x7100_7200);
        assert_eq!(word("bias_fo", 1251), 0x7100_7100);
        assert_eq!(word("bias_fo", 1800), 0x7100_0000);
        assert_eq!(word("bias_pr", 975), 0x4100_3b00);
        assert_eq!(word("bias_pr", 1157), 0x4100_0800);
        assert_eq!(word("bias_pr", 1158), 0x5114_bc00);
        assert_eq!(word("bias_pr", 1526), 0x5100_0000);
        assert_eq!(word("bias_hpf", 900), 0x4100_8500);
        assert_eq!(word("bias_refr", 1300), 0x5116_9200);
        assert_eq!(word("bias_refr", 1653), 0x5100_0000);
    }

    /// Values at which a table of single points, and not of every millivolt, would guess.
    #[test]
    fn every_millivolt_of_every_range_has_a_code() {
        for bias in &BIASES {
            for mv in bias.range_mv.clone() {
                bias.encode(mv).unwrap();
            }
            for mv in [bias.range_mv.start() - 1, bias.range_mv.end() + 1] {
                assert!(bias.encode(mv).is_err(), "{} {mv} mV", bias.name);
            }
        }
        assert_eq!(word("bias_hpf", 901), 0x4100_8300);
        assert_eq!(word("bias_hpf", 907), 0x4100_7f00);
        assert_eq!(word("bias_hpf", 947), 0x4100_5000);
        assert_eq!(word("bias_hpf", 974), 0x4100_3c00);
    }

    #[test]
    fn interlocks_refuse_and_name_rule_and_values() {
        let refusals = [
            refusal(&[("bias_diff_on", 373)]),
            refusal(&[
                ("bias_fo", 1349),
                ("bias_diff_on", 393),
                ("bias_diff_off", 214),
            ]),
            refusal(&[("bias_diff_off", 235)]),
            refusal(&[
                ("bias_fo", 1349),
                ("bias_diff_on", 394),
                ("bias_diff_off", 215),
            ]),
            refusal(&[("bias_fo", 1399), ("bias_refr", 1349)]),
            refusal(&[("bias_diff", 300)]),
            refusal(&[("bias_fo", 1249)]),
            refusal(&[("bias_fun", 1)]),
        ];
        insta::assert_snapshot!(refusals.join("\n"), @r"
expected bias_diff_on >= bias_diff + 75 = 374 mV with bias_diff 299 mV and bias_fo 1477 mV (not below 1350), found 373 mV
expected bias_diff_on >= bias_diff + 95 = 394 mV with bias_diff 299 mV and bias_fo 1349 mV (below 1350), found 393 mV
expected bias_diff_off <= bias_diff - 65 = 234 mV with bias_diff 299 mV and bias_fo 1477 mV (not below 1350), found 235 mV
expected bias_diff_off <= bias_diff - 85 = 214 mV with bias_diff 299 mV and bias_fo 1349 mV (below 1350), found 215 mV
expected bias_refr >= 1350 mV with bias_fo 1399 mV (below 1400), found 1349 mV
expected bias_diff of 299 mV, the fixed reference of the contrast thresholds, found 300 mV
expected bias_fo in 1250..=1800 mV, found 1249 mV
expected a bias out of bias_diff, bias_diff_off, bias_diff_on, bias_fo, bias_hpf, bias_pr, bias_refr, found bias_fun
");
        // The last values that are allowed.
        for allowed in [
            &[("bias_diff_on", 374), ("bias_diff_off", 234)][..],
            &[
                ("bias_fo", 1350),
                ("bias_diff_on", 374),
                ("bias_diff_off", 234),
            ],
            &[
                ("bias_fo", 1349),
                ("bias_diff_on", 394),
                ("bias_diff_off", 214),
            ],
            &[("bias_fo", 1399), ("bias_refr", 1350)],
            &[("bias_fo", 1400), ("bias_refr", 1300)],
        ] {
            let requested = allowed.iter().map(|&(n, v)| (n.to_owned(), v)).collect();
            complete(&requested).unwrap();
        }
    }

    /// Every DAC falls or rises throughout its range: a slip in a table would break this.
    #[test]
    fn codes_are_monotone() {
        for (name, range) in [
            ("bias_diff_on", 0..=1800),
            ("bias_fo", 1250..=1800),
            ("bias_hpf", 900..=1157),
            ("bias_hpf", 1158..=1800),
            ("bias_refr", 1300..=1800),
        ] {
            let rising = name == "bias_diff_on";
            let mut codes: Vec<u32> = range.map(|mv| word(name, mv) & 0x001f_ffff).collect();
            if rising {
                codes.reverse();
            }
            assert!(codes.is_sorted_by(|a, b| a >= b), "{name}");
        }
    }
}
