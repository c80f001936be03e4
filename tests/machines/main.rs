//! Results are the same to the last bit on every processor: each part's digest, on this machine and on emulated ones.
//!
//! `tests/machines/run` repeats these tests on an x86-64 without AVX2 and FMA, and on aarch64 (both emulated by QEMU).
#![expect(clippy::unwrap_used, reason = "tests")]

mod skins;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_analysis::analyze;
use skinrig_compare::causes::causes;
use skinrig_compare::{ComparisonOptions, Metric, compare};
use skinrig_model::{CameraId, Locator, Point3, ScenePart, SimLevel};
use skinrig_sim::SimConfig;
use skinrig_sim::geometric::GeometricModel;
use skinrig_sim::optical::{OpticalConfig, OpticalModel, Parts};
use skinrig_sim::scene::{GRID_NS, PixelModel, TipSample};

/// First eight bytes of the SHA-256 of a value as JSON, which has every bit of its numbers.
fn digest(value: &impl Serialize) -> String {
    let bytes = serde_json::to_vec(value).unwrap();
    let hash = Sha256::digest(bytes);
    hash[..8].iter().map(|b| format!("{b:02x}")).collect()
}

/// A press of 1.6 mm in 0.3 s, then 0.2 s of rest.
fn tips() -> Vec<TipSample> {
    (0..500)
        .map(|ms| {
            let down = (f64::from(ms) / 100.0)
                .min(1.0)
                .min(f64::from(300 - ms) / 100.0);
            TipSample {
                t_ns: i64::from(ms) * GRID_NS,
                position: Point3::new(-6.0, 14.0, 1.0 - 2.6 * down.max(0.0)),
            }
        })
        .collect()
}

/// Number and digest of the events of a press.
fn events(mut model: impl PixelModel) -> (usize, String) {
    let mut found = Vec::new();
    model.advance(&tips(), &mut found);
    let rows: Vec<_> = found
        .iter()
        .map(|e| (e.t_ns, e.x, e.y, e.polarity.bit()))
        .collect();
    (rows.len(), digest(&rows))
}

#[test]
fn a_simulated_press_has_the_same_events() {
    let config = SimConfig::new(5, SimLevel::Optical);
    let scene = config.scene(CameraId::One);
    let parts = |parts: &[ScenePart]| OpticalConfig {
        parts: Parts::of_paper(parts),
        ..OpticalConfig::default()
    };
    let optical = |c| OpticalModel::with_config(&scene, c, 1).unwrap();
    let found = [
        (
            "geometric",
            events(GeometricModel::new(&scene, &config.geometric)),
        ),
        ("optical", events(optical(parts(&[])))),
        (
            "optical with every part",
            events(optical(parts(&ScenePart::ALL))),
        ),
    ];
    let expected = [
        ("geometric", (6606, "a1ad8caffa1e8f9f")),
        ("optical", (4453, "5bce230200d69d10")),
        ("optical with every part", (5802, "059430ae3ca8ed0a")),
    ];
    assert_eq!(
        found,
        expected.map(|(part, (n, digest))| (part, (n, digest.to_owned())))
    );
}

#[test]
fn an_analysis_has_the_same_results() {
    let found = [
        Locator::Auto,
        Locator::Geometry,
        Locator::Field,
        Locator::Direct,
    ]
    .map(|locator| {
        let (mut input, events) = skinrig_planted::grid::session();
        input.settings.locator = locator;
        input.settings.study_presses = 20;
        (locator.name(), digest(&analyze(&input, &events).unwrap()))
    });
    let expected = [
        ("auto", "24dbb155d58cbc0d"),
        ("geometry", "8287d4e6ade43ecc"),
        ("field", "968b09dbb819256e"),
        ("direct", "e8e490dab225cc16"),
    ];
    assert_eq!(
        found,
        expected.map(|(locator, digest)| (locator, digest.to_owned()))
    );
}

#[test]
fn a_comparison_has_the_same_verdict() {
    let [a, b] = [('A', 1), ('B', 2)].map(|(letter, seed)| skins::skin(letter, seed));
    let options = ComparisonOptions {
        margins: vec![(Metric::Rmse, 0.06)],
        ..ComparisonOptions::default()
    };
    let compared = compare(&[a.clone(), b.clone()], &Vec::new(), &options);
    let found = [
        ("comparison", digest(&compared)),
        ("causes", digest(&causes(&a, &b, None, 200, 1).unwrap())),
    ];
    let expected = [
        ("comparison", "6b945170553100b9"),
        ("causes", "15b3f84166b06e22"),
    ];
    assert_eq!(
        found,
        expected.map(|(part, digest)| (part, digest.to_owned()))
    );
}
