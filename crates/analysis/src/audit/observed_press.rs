//! Owns the presses as the audit sees them: position of the tip, observation of each camera, and visibility.

use skinrig_model::{
    CameraId, LocationId, Point2, PressId, PressOutcome, PressRole, PressTiming, PressVerdict,
    RepetitionId,
};

use crate::bursts::PressBurst;
use crate::input::SessionInput;
use crate::result::{Analysis, PressView};

/// A response above the idle rate by this many standard errors gives a usable centroid.
const RESPONSE_SIGMAS: f64 = 2.0;
/// Points closer to the edge of the nominal field of view may be outside the true one, degrees. Skews of several degrees are
/// common between a nominal and a calibrated rig (the paper's are 1.9 and 1.5).
const FIELD_MARGIN_DEG: f64 = 6.0;

/// An attempted press of the path or of the sync part.
pub(crate) struct ObservedPress<'a> {
    /// Press.
    pub press: PressId,
    /// Role of the press.
    pub role: PressRole,
    /// Repetition.
    pub repetition: RepetitionId,
    /// Location and planned depth: identifies what is repeated.
    pub place: (LocationId, u64),
    /// Planned position.
    pub planned: Point2,
    /// Planned depth, mm; `None` if it stopped above because it was felt.
    pub depth_mm: Option<f64>,
    /// Measured position, if finite.
    pub truth: Option<Point2>,
    /// Measured times.
    pub timing: Option<PressTiming>,
    /// Journal entry.
    pub outcome: &'a PressOutcome,
    /// Observation of each camera.
    pub sights: [CameraObservation; 2],
}

/// Observation of a press by one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CameraObservation {
    /// Centroid column of a significant press, px.
    pub column: Option<f64>,
    /// Centroid column of any press, px: the analysis locates with it.
    pub centroid: Option<f64>,
    /// Events of the press above the idle prediction, in standard errors; `None` if unknown, or if the press is at the edge
    /// of the nominal field of view or outside it.
    pub response: Option<f64>,
    /// Events per second in the press and in the idle time before it, if both are known.
    pub rates: Option<(f64, f64)>,
}

impl ObservedPress<'_> {
    /// Measured position, or planned position if not measured.
    pub(super) fn at(&self) -> Point2 {
        self.truth.unwrap_or(self.planned)
    }

    /// True if the journal reports no problem.
    pub(super) fn is_complete(&self) -> bool {
        self.outcome.verdict == PressVerdict::Valid
    }
}

/// Attempted presses, in plan order.
pub(crate) fn observed_presses<'a>(
    input: &'a SessionInput,
    analysis: &Analysis,
    bursts: &[Vec<Option<PressBurst>>; 2],
) -> Vec<ObservedPress<'a>> {
    let rows = input.planned.iter().zip(&input.outcomes).enumerate();
    rows.filter_map(|(row, (planned, outcome))| {
        let outcome = outcome.as_ref()?;
        if matches!(outcome.verdict, PressVerdict::Missed(_)) {
            return None;
        }
        let truth = outcome.measured_at.filter(|p| is_number(*p));
        let at = truth.unwrap_or(planned.at);
        let views = analysis.presses.get(row).map_or([None; 2], |p| p.views);
        let sights = CameraId::ALL.map(|camera| {
            let visible = is_visible(input, camera, at);
            let burst = bursts[camera.index()].get(row).copied().flatten();
            sight(input, views[camera.index()], burst, visible)
        });
        Some(ObservedPress {
            press: planned.id,
            role: planned.role,
            repetition: planned.repetition,
            place: (planned.location, planned.depth_mm.to_bits()),
            planned: planned.at,
            depth_mm: (!input.stopped.contains(&planned.id)).then_some(planned.depth_mm),
            truth,
            timing: outcome.timing,
            outcome,
            sights,
        })
    })
    .collect()
}

/// True when both coordinates are finite.
pub(super) fn is_number(p: Point2) -> bool {
    p.x_mm.is_finite() && p.y_mm.is_finite()
}

fn is_visible(input: &SessionInput, camera: CameraId, at: Point2) -> bool {
    let model = &input.rig.nominal.cameras[camera.index()];
    let angle = model.angle_of_point_deg(at) - model.skew_deg;
    let (left, right) = (model.lens.angle_deg(-1.0).0, model.lens.angle_deg(1.0).0);
    angle > left + FIELD_MARGIN_DEG && angle < right - FIELD_MARGIN_DEG
}

fn sight(
    input: &SessionInput,
    view: Option<PressView>,
    burst: Option<PressBurst>,
    visible: bool,
) -> CameraObservation {
    let Some(view) = view else {
        return CameraObservation {
            column: None,
            centroid: None,
            response: None,
            rates: None,
        };
    };
    let rates = burst.and_then(|burst| burst.rates());
    let response = burst.and_then(|burst| burst.response());
    let strong = view.cluster_events >= input.settings.min_cluster_events
        && response.is_none_or(|r| r > RESPONSE_SIGMAS);
    let centroid = view.centroid_u.filter(|u| u.is_finite());
    CameraObservation {
        column: centroid.filter(|_| strong),
        centroid,
        response: response.filter(|_| visible),
        rates,
    }
}
