//! Units from the ends of field names.

/// A unit that a field's name can end in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Unit {
    /// End of the field's name.
    pub suffix: &'static str,
    /// As typed in files.
    pub name: &'static str,
    /// Variant of `Dimension`.
    pub dimension: &'static str,
    /// Number of these units in the dimension's own unit.
    pub per: f64,
}

const fn unit(suffix: &'static str, name: &'static str, dimension: &'static str, per: f64) -> Unit {
    Unit {
        suffix,
        name,
        dimension,
        per,
    }
}

/// Longer suffixes before shorter ones that they contain.
const UNITS: &[Unit] = &[
    unit("_mm_s3", "mm/s3", "Jerk", 1.0),
    unit("_mm_s2", "mm/s2", "Acceleration", 1.0),
    unit("_mm_s", "mm/s", "Speed", 1.0),
    unit("_ev_s", "ev/s", "EventRate", 1.0),
    unit("_b_s", "B/s", "DataRate", 1.0),
    unit("_deg_c", "degC", "Temperature", 1.0),
    unit("_percent", "%", "Share", 1.0),
    unit("_ppm", "ppm", "Drift", 1.0),
    unit("_deg", "deg", "Angle", 1.0),
    unit("_mm", "mm", "Length", 1.0),
    unit("_ms", "ms", "Time", 1e3),
    unit("_us", "us", "Time", 1e6),
    unit("_hz", "Hz", "Frequency", 1.0),
    unit("_px", "px", "Pixels", 1.0),
    unit("_kg", "kg", "Mass", 1.0),
    unit("_n", "N", "Force", 1.0),
    unit("_b", "B", "Data", 1.0),
    unit("_s", "s", "Time", 1.0),
];

/// Seconds, the unit of durations.
pub(crate) const SECONDS: Unit = unit("", "s", "Time", 1.0);

/// The unit in which a name ends, and the name without it.
pub(crate) fn of_name(name: &str) -> Option<(Unit, &str)> {
    UNITS
        .iter()
        .find_map(|u| Some((*u, name.strip_suffix(u.suffix)?)))
}

/// The unit as typed in files.
pub(crate) fn of_text(text: &str) -> Option<Unit> {
    UNITS.iter().find(|u| u.name == text).copied()
}

/// The size of a typed unit in the own unit of `dimension`: mirrors `Dimension::units` for the units of defaults.
fn size(dimension: &str, typed: &str) -> Option<f64> {
    let sizes: &[(&str, f64)] = match dimension {
        "Time" => &[
            ("s", 1.0),
            ("ms", 1e-3),
            ("us", 1e-6),
            ("min", 60.0),
            ("h", 3600.0),
        ],
        "Force" => &[("N", 1.0), ("mN", 1e-3)],
        "Data" => &[("B", 1.0), ("kB", 1e3), ("MB", 1e6), ("GB", 1e9)],
        "DataRate" => &[("B/s", 1.0), ("kB/s", 1e3), ("MB/s", 1e6), ("GB/s", 1e9)],
        "EventRate" => &[("ev/s", 1.0), ("kev/s", 1e3), ("Mev/s", 1e6)],
        "Mass" => &[("kg", 1.0), ("g", 1e-3)],
        _ => &[],
    };
    sizes.iter().find(|(n, _)| *n == typed).map(|(_, s)| *s)
}

impl Unit {
    /// A typed quantity in this unit, computed like in the reader.
    pub(crate) fn value_of(self, text: &str) -> Option<f64> {
        let (number, typed) = text.trim().split_once(' ')?;
        let number: f64 = number.parse().ok()?;
        if typed == self.name && self.per == 1.0 {
            return Some(number);
        }
        let own = number * size(self.dimension, typed.trim())?;
        const STEPS: f64 = 1e9;
        if self.per == 1.0 {
            Some(own)
        } else {
            Some((own * STEPS).round() / (STEPS / self.per))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_name_gives_unit_and_key() {
        for (name, unit, key) in [
            ("max_speed_mm_s", "mm/s", "max_speed"),
            ("window_before_ms", "ms", "window_before"),
            ("period_s", "s", "period"),
            ("threshold_n", "N", "threshold"),
        ] {
            let (found, rest) = of_name(name).unwrap_or((SECONDS, ""));
            assert_eq!((found.name, rest), (unit, key));
        }
        assert_eq!(of_name("samples"), None);
    }

    #[test]
    fn defaults_are_converted() {
        let of = |name: &str, text: &str| of_name(name).and_then(|(u, _)| u.value_of(text));
        assert_eq!(of("a_ms", "50 ms"), Some(50.0));
        assert_eq!(of("a_us", "5 ms"), Some(5000.0));
        assert_eq!(of("a_n", "200 mN"), Some(0.2));
        assert_eq!(of("a_mm", "1 s"), None);
        assert_eq!(SECONDS.value_of("10 min"), Some(600.0));
    }
}
