//! The code that `derive(Settings)` writes: defaults, ranges, findings.

use skinrig_settings::{Choice, Collector, Diagnostics, Field, Settings, open};

/// A direction.
#[derive(Debug, Clone, Copy, PartialEq, Choice)]
enum Direction {
    /// Up.
    Up,
    /// Straight down.
    StraightDown,
}

/// One item.
#[derive(Debug, PartialEq, Settings)]
#[settings(finish = Self::not_seven)]
struct Item {
    /// A count.
    #[setting(min = 1, max = 9)]
    count: u32,
}

impl Item {
    fn not_seven(self, field: &Field, out: &mut Collector) -> Option<Self> {
        if self.count == 7 {
            out.error(field.span, field.path.as_str(), "seven");
            return None;
        }
        Some(self)
    }
}

/// One key of each kind.
#[derive(Debug, PartialEq, Settings)]
#[settings(name = "all")]
struct All {
    /// A length.
    #[setting(default = "0.3 mm", above = 0.0, max = 10.0)]
    length_mm: f64,
    /// Milliseconds.
    #[setting(default = "2.5 s", max = 1e6)]
    window_ms: f64,
    /// Whole microseconds.
    #[setting(default = "3 ms", max = 5000)]
    delay_us: u16,
    /// Seconds.
    #[setting(default = "10 min", max = 1e6)]
    wait_s: f64,
    /// A force.
    #[setting(default = "200 mN", max = 12.0)]
    force_n: f64,
    /// A mass.
    #[setting(default = "140 g", max = 1.0)]
    mass_kg: f64,
    /// Space.
    #[setting(default = "2 GB", max = 1e15)]
    free_b: f64,
    /// A rate of bytes.
    #[setting(default = "20 MB/s", max = 1e12)]
    bytes_b_s: f64,
    /// A rate of events.
    #[setting(default = "50 kev/s", max = 1e12)]
    events_ev_s: f64,
    /// A plain number.
    #[setting(default = "0.05", max = 1.0)]
    share: f64,
    /// A word.
    #[setting(default = "straight_down")]
    direction: Direction,
    /// Items.
    #[setting(default = "[]", items = 0..=5)]
    items: Vec<Item>,
    /// May be absent.
    #[setting(max = 5.0)]
    depth_mm: Option<f64>,
}

fn read(text: &str) -> Result<All, Diagnostics> {
    let (mut out, root) = open("test.yaml", text.as_bytes(), &[], All::TABLE)?;
    match root.and_then(|root| All::from_mapping(&root, &mut out)) {
        Some(all) if out.is_clean() => Ok(all),
        _ => Err(out.finish()),
    }
}

#[test]
fn the_default_of_a_struct_is_what_its_text_reads_as() {
    assert_eq!(read("{}").unwrap(), All::default());
    assert_eq!(All::default().direction, Direction::StraightDown);
    assert_eq!(All::default().window_ms, 2500.0);
}

#[test]
fn the_rows_read_back() {
    let all = All {
        length_mm: 1.25,
        window_ms: 0.2,
        items: vec![Item { count: 3 }],
        depth_mm: Some(2.0),
        direction: Direction::Up,
        ..All::default()
    };
    let rows = all.rows();
    let text: Vec<String> = rows
        .iter()
        .map(|row| format!("{}: {}", row.key, row.value))
        .collect();
    assert_eq!(read(&text.join("\n")).unwrap(), all);
}

#[test]
fn a_value_built_in_code_is_held_against_the_declared_range() {
    let wrong = |change: fn(&mut All)| {
        let mut all = All::default();
        change(&mut all);
        all.out_of_range().map(|out| out.key)
    };
    assert_eq!(wrong(|_| {}), None);
    assert_eq!(wrong(|a| a.length_mm = 0.0).as_deref(), Some("length"));
    assert_eq!(wrong(|a| a.length_mm = f64::NAN).as_deref(), Some("length"));
    assert_eq!(wrong(|a| a.delay_us = 5001).as_deref(), Some("delay"));
    assert_eq!(wrong(|a| a.depth_mm = Some(5.1)).as_deref(), Some("depth"));
}

#[test]
fn the_findings_of_every_item_appear_and_a_fraction_is_not_rounded() {
    let found = read("items: [{count: 7}, {count: 2}, {count: 7}]\ndelay: 1.5 us").unwrap_err();
    let places: Vec<&str> = found.list().iter().map(|d| d.path.as_str()).collect();
    assert_eq!(places, ["items[0]", "items[2]", "delay"]);
    assert!(read("delay: 5001 us").is_err());
    assert!(read("length: 0 mm").is_err());
    assert!(read("direction: down").is_err());
}
