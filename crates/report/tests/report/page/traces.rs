//! Clocks, robot and tradeoff in the page, and packed data columns.
#![expect(clippy::unwrap_used, reason = "tests")]

use skinrig_report::html;

use crate::page::input;
use crate::support;

/// Missing figures are explained.
#[test]
fn clocks_robot_and_tradeoff_are_drawn_or_their_absence_is_told() {
    let mut analysis = support::analysis(4, 3);
    let mut with_reason = input(&analysis);
    let why = std::io::Error::other("s.tradeoff.json: expected <a> result");
    with_reason.tradeoff = Some(Err(&why));
    let page = html(&with_reason);
    assert!(page.contains("data-testid=\"tradeoff-unreadable\""));
    assert!(page.contains("expected &lt;a&gt; result") && !page.contains("\"no-tradeoff\""));
    let clocks = skinrig_report::figures::clock_residuals(&with_reason).unwrap();
    // One panel per map; a rejected point is drawn at the edge and does not stretch the axis.
    for panel in ["host from box", "camera 1 from box", "camera 2 from box"] {
        assert!(clocks.svg.contains(panel), "{panel}");
    }
    assert_eq!(clocks.svg.matches("h6v6h-6Z").count(), 3);
    assert!(
        clocks.svg.contains(">-0.5<") || clocks.svg.contains(">-0.50<"),
        "{}",
        clocks.svg
    );
    let course = skinrig_report::figures::pose_course(&with_reason).unwrap();
    assert!(
        course
            .caption
            .contains("0.050 mm root mean square, 0.300 mm at most")
    );
    assert!(
        course
            .caption
            .contains("2 samples without finite positions")
    );
    analysis.motion = None;
    analysis.alignment.residuals.clear();
    let page = html(&input(&analysis));
    for id in ["no-clock-residuals", "no-pose", "no-tradeoff"] {
        assert!(page.contains(&format!("data-testid=\"{id}\"")), "{id}");
    }
}

/// Unpacks a column like the page's script.
fn unpacked(column: &serde_json::Value) -> Vec<serde_json::Value> {
    if let Some(runs) = column["runs"].as_array() {
        let count = |c: &serde_json::Value| c.as_u64().unwrap() as usize;
        let cells = runs.chunks(2);
        return cells
            .flat_map(|r| vec![r[0].clone(); count(&r[1])])
            .collect();
    }
    if column["per"].is_u64() {
        let (mut sum, per) = (0, column["per"].as_i64().unwrap());
        let steps = unpacked(&column["steps"]).into_iter();
        let whole = steps.map(|s| {
            sum += s.as_i64().unwrap();
            assert_eq!(sum % per, 0);
            serde_json::json!(sum / per)
        });
        return whole.collect();
    }
    column.as_array().unwrap().clone()
}

/// Columns with long runs or small steps are packed; unpacking restores the analysis values.
#[test]
fn packed_columns_hold_every_cell() {
    let analysis = support::analysis(4, 3);
    let page = html(&input(&analysis));
    let data = page.split("id=\"report-data\">").nth(1).unwrap();
    let data: serde_json::Value =
        serde_json::from_str(data.split("</script>").next().unwrap()).unwrap();
    let table = &data["tables"]["presses"];
    let at = |name: &str| {
        let columns = table["columns"].as_array().unwrap();
        unpacked(&table["data"][columns.iter().position(|c| c == name).unwrap()])
    };
    let repetitions: Vec<u32> = analysis
        .presses
        .iter()
        .map(|p| p.repetition.number())
        .collect();
    assert_eq!(
        serde_json::json!(at("repetition")),
        serde_json::json!(repetitions)
    );
    let roles: Vec<_> = analysis.presses.iter().map(|p| p.role).collect();
    assert_eq!(serde_json::json!(at("role")), serde_json::json!(roles));
    let numbers: Vec<u32> = analysis.presses.iter().map(|p| p.press.number()).collect();
    assert_eq!(serde_json::json!(at("press")), serde_json::json!(numbers));
}
