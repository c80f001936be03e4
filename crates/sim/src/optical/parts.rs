//! Physics that the base model leaves out, as parts that a scene switches on. Sources of the constants: `sources`.

use serde::Serialize;

use skinrig_model::ScenePart;

/// Constants of the parts that are on; `None`: off.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Parts {
    /// Where the dent of a press lies, from press to press.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press_scatter: Option<PressScatter>,
    /// Presses that dent the skin less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weak_presses: Option<WeakPresses>,
    /// A slow part of the skin's recovery.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_recovery: Option<SlowRecovery>,
    /// Refraction where light leaves the skin towards the lens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pod_refraction: Option<PodRefraction>,
    /// Emitters of unequal power, and a skin that is cloudier in places.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven_light: Option<UnevenLight>,
    /// Pixels that differ in refractory time and threshold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven_pixels: Option<UnevenPixels>,
    /// Noise that comes from few pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven_noise: Option<UnevenNoise>,
    /// Dark pixels respond later.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dark_latency: Option<DarkLatency>,
    /// Events wait until the sensor reads their row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub readout: Option<Readout>,
}

/// Normal scatter of the dent about the tip, equal for both cameras.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PressScatter {
    /// Standard deviation per axis, mm.
    pub offset_mm: f64,
    /// Standard deviation of the depth, as a share of it.
    pub depth: f64,
}

/// Presses whose dent is shallower than the tip's depth, equal for both cameras.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WeakPresses {
    /// Share of the presses.
    pub share: f64,
    /// Their depth, as a share of the tip's.
    pub depth: f64,
}

/// A shallow dent that remains when the tip leaves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlowRecovery {
    /// Its depth, as a share of the tip's.
    pub fraction: f64,
    /// Time constant, ms.
    pub time_ms: f64,
}

/// A round pod of air around the lens, moulded with its centre beside the lens: rays bend where they enter the skin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PodRefraction {
    /// Refractive index of the skin.
    pub index: f64,
    /// Radius of the pod, mm.
    pub radius_mm: f64,
    /// Distance of its centre from the lens, mm; the direction is drawn per camera.
    pub offset_mm: f64,
}

/// Spread of the light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnevenLight {
    /// Standard deviation of the logarithm of an emitter's power.
    pub emitters: f64,
    /// Standard deviation of the logarithm of the scattering, from place to place.
    pub cloud: f64,
    /// Length over which it varies, mm.
    pub cloud_mm: f64,
}

/// Spread of the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnevenPixels {
    /// Mean of either threshold, natural-log intensity; replaces `threshold_on` and `threshold_off`.
    pub threshold: f64,
    /// Standard deviation of either threshold from pixel to pixel; replaces `threshold_sigma`.
    pub threshold_sigma: f64,
    /// Shortest refractory time, µs.
    pub refractory_least_us: f64,
    /// Mean of the exponential rest, µs.
    pub refractory_mean_us: f64,
}

/// Noise that replaces the base model's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnevenNoise {
    /// As `leak_hz`.
    pub leak_hz: f64,
    /// As `shot_hz`.
    pub shot_hz: f64,
    /// Events of both signs per second of a dark pixel, in the rows beside the skin.
    pub dark_hz: f64,
    /// As `hot_pixels`.
    pub hot_pixels: u32,
    /// As `hot_hz`.
    pub hot_hz: f64,
    /// As `hot_ratio`.
    pub hot_ratio: f64,
}

/// Delay of a pixel at brightness `q` (1: the brightest): `bright_us / q`, at most `most_us`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DarkLatency {
    /// At the brightest pixel, µs.
    pub bright_us: f64,
    /// Of the darkest pixels, µs.
    pub most_us: f64,
}

/// The sensor reads rows one after the other; events of a row that are read together have one timestamp.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Readout {
    /// Rows read per µs.
    pub rows_per_us: u32,
    /// Events read per µs.
    pub events_per_us: u32,
}

impl Parts {
    /// The constants of the scene `paper`: every part is on.
    pub const PAPER: Self = Self {
        press_scatter: Some(PressScatter {
            offset_mm: 2.1,
            depth: 0.1,
        }),
        weak_presses: Some(WeakPresses {
            share: 0.035,
            depth: 0.15,
        }),
        slow_recovery: Some(SlowRecovery {
            fraction: 0.2,
            time_ms: 3_000.0,
        }),
        pod_refraction: Some(PodRefraction {
            index: 1.41,
            radius_mm: 3.0,
            offset_mm: 1.6,
        }),
        uneven_light: Some(UnevenLight {
            emitters: 0.3,
            cloud: 0.3,
            cloud_mm: 20.0,
        }),
        uneven_pixels: Some(UnevenPixels {
            threshold: 0.148,
            threshold_sigma: 0.03,
            refractory_least_us: 11.0,
            refractory_mean_us: 500.0,
        }),
        uneven_noise: Some(UnevenNoise {
            leak_hz: 0.0003,
            shot_hz: 0.001,
            dark_hz: 0.017,
            hot_pixels: 20,
            hot_hz: 60.0,
            hot_ratio: 0.8,
        }),
        dark_latency: Some(DarkLatency {
            bright_us: 200.0,
            most_us: 20_000.0,
        }),
        readout: Some(Readout {
            rows_per_us: 5,
            events_per_us: 30,
        }),
    };

    /// The paper's constants of these parts.
    #[must_use]
    pub fn of_paper(parts: &[ScenePart]) -> Self {
        let all = Self::PAPER;
        fn on<T>(parts: &[ScenePart], part: ScenePart, value: Option<T>) -> Option<T> {
            value.filter(|_| parts.contains(&part))
        }
        Self {
            press_scatter: on(parts, ScenePart::PressScatter, all.press_scatter),
            weak_presses: on(parts, ScenePart::WeakPresses, all.weak_presses),
            slow_recovery: on(parts, ScenePart::SlowRecovery, all.slow_recovery),
            pod_refraction: on(parts, ScenePart::PodRefraction, all.pod_refraction),
            uneven_light: on(parts, ScenePart::UnevenLight, all.uneven_light),
            uneven_pixels: on(parts, ScenePart::UnevenPixels, all.uneven_pixels),
            uneven_noise: on(parts, ScenePart::UnevenNoise, all.uneven_noise),
            dark_latency: on(parts, ScenePart::DarkLatency, all.dark_latency),
            readout: on(parts, ScenePart::Readout, all.readout),
        }
    }

    /// `scene paper`, with the parts that it lacks; `own parts` with other constants; `None` without any part.
    #[must_use]
    pub fn label(&self) -> Option<String> {
        if !self.is_of_paper() {
            return Some("own parts".to_owned());
        }
        let has = |part: &ScenePart| match part {
            ScenePart::PressScatter => self.press_scatter.is_some(),
            ScenePart::WeakPresses => self.weak_presses.is_some(),
            ScenePart::SlowRecovery => self.slow_recovery.is_some(),
            ScenePart::PodRefraction => self.pod_refraction.is_some(),
            ScenePart::UnevenLight => self.uneven_light.is_some(),
            ScenePart::UnevenPixels => self.uneven_pixels.is_some(),
            ScenePart::UnevenNoise => self.uneven_noise.is_some(),
            ScenePart::DarkLatency => self.dark_latency.is_some(),
            ScenePart::Readout => self.readout.is_some(),
        };
        let (on, off): (Vec<_>, Vec<_>) = ScenePart::ALL.into_iter().partition(has);
        let lacks: Vec<&str> = off.into_iter().map(ScenePart::name).collect();
        match (on.is_empty(), lacks.is_empty()) {
            (true, _) => None,
            (false, true) => Some("scene paper".to_owned()),
            (false, false) => Some(format!("scene paper without {}", lacks.join(", "))),
        }
    }

    /// Whether every part that is on has the paper's constants.
    fn is_of_paper(&self) -> bool {
        fn same<T: PartialEq>(part: Option<T>, paper: Option<T>) -> bool {
            part.is_none() || part == paper
        }
        let paper = Self::PAPER;
        same(self.press_scatter, paper.press_scatter)
            && same(self.weak_presses, paper.weak_presses)
            && same(self.slow_recovery, paper.slow_recovery)
            && same(self.pod_refraction, paper.pod_refraction)
            && same(self.uneven_light, paper.uneven_light)
            && same(self.uneven_pixels, paper.uneven_pixels)
            && same(self.uneven_noise, paper.uneven_noise)
            && same(self.dark_latency, paper.dark_latency)
            && same(self.readout, paper.readout)
    }

    /// Whether dents differ from press to press.
    pub(super) const fn varies_presses(&self) -> bool {
        self.press_scatter.is_some() || self.weak_presses.is_some()
    }
}
