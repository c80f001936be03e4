//! Keys of cameras: settings and geometry.

use std::collections::BTreeMap;

use skinrig_model::{CameraModel, LensModel, Point2, SENSOR_HEIGHT, SENSOR_WIDTH};
use skinrig_settings::{Collector, Field, Setting, Settings};

use crate::protocol::CameraRequest;

/// Settings of the two cameras.
#[derive(Settings)]
pub(crate) struct Cameras {
    /// Camera 1.
    pub camera1: Option<CameraKeys>,
    /// Camera 2.
    pub camera2: Option<CameraKeys>,
}

impl Cameras {
    /// Requested settings of camera 1 and camera 2.
    pub(crate) fn requests(self) -> [CameraRequest; 2] {
        [self.camera1, self.camera2].map(|keys| {
            let keys = keys.unwrap_or_default();
            CameraRequest {
                biases: keys.biases.unwrap_or_default(),
                roi: keys.roi,
            }
        })
    }
}

/// Settings of one camera; missing ones keep the device's default.
#[derive(Settings)]
#[settings(name = "camera")]
pub(crate) struct CameraKeys {
    /// Bias values by name, in the device's own unit.
    biases: Option<BTreeMap<String, i64>>,
    /// Pixels that stay on; all when absent.
    #[setting(shape = Roi::SHAPE, read = Roi::read, show = Roi::show)]
    roi: Option<[u16; 4]>,
}

/// A rectangle of pixels that stay on.
#[derive(Settings)]
pub(crate) struct Roi {
    /// First column.
    #[setting(max = 639)]
    x: u16,
    /// First row.
    #[setting(max = 479)]
    y: u16,
    /// Columns.
    #[setting(min = 1, max = 640)]
    width: u16,
    /// Rows.
    #[setting(min = 1, max = 480)]
    height: u16,
}

impl Roi {
    /// First column, first row, columns, rows.
    pub(crate) fn read(field: &Field, out: &mut Collector) -> Option<[u16; 4]> {
        let Self {
            x,
            y,
            width,
            height,
        } = Self::from_mapping(field, out)?;
        if x + width > SENSOR_WIDTH || y + height > SENSOR_HEIGHT {
            out.error(field.span, field.path.as_str(), "larger than the sensor")
                .expected("x + width of at most 640 and y + height of at most 480")
                .found(format!("{} and {}", x + width, y + height));
        }
        Some([x, y, width, height])
    }

    pub(crate) fn show([x, y, width, height]: &[u16; 4]) -> String {
        format!("{{x: {x}, y: {y}, width: {width}, height: {height}}}")
    }
}

/// Position and orientation of a camera, drawn or measured.
#[derive(Settings)]
pub(crate) struct NominalCamera {
    /// Its optical centre.
    position: Point2,
    /// Where its axis points; the centre of the outline when absent.
    pub aim: Option<Point2>,
    /// Turn of the axis away from the aim, clockwise.
    #[setting(default = "0 deg", min = -90.0, max = 90.0)]
    skew_deg: f64,
    /// Half of the horizontal field of view.
    #[setting(above = 0.0, max = 90.0)]
    half_field_of_view_deg: f64,
    /// Distortion W of the lens.
    #[setting(default = "0", min = -1.0, max = 1.0)]
    distortion: f64,
}

impl NominalCamera {
    /// The camera; it aims at `centre` unless the file says otherwise. Reports one that stands where it looks.
    pub(crate) fn checked(
        &self,
        centre: Point2,
        field: &Field,
        out: &mut Collector,
    ) -> Option<CameraModel> {
        let model = self.model(centre);
        if model.position != model.aim {
            return Some(model);
        }
        let at = field.at("position");
        let Point2 { x_mm, y_mm } = model.aim;
        out.error(
            at.span,
            at.path.as_str(),
            "the camera stands at the point it aims at",
        )
        .expected("a position outside the skin, from which the camera looks in")
        .found(format!("[{x_mm} mm, {y_mm} mm], where its axis points"));
        None
    }

    /// The camera; it aims at `centre` unless the file says otherwise.
    pub(crate) fn model(&self, centre: Point2) -> CameraModel {
        CameraModel {
            position: self.position,
            aim: self.aim.unwrap_or(centre),
            skew_deg: self.skew_deg,
            lens: LensModel::Exponential {
                half_fov_deg: self.half_field_of_view_deg,
                w: self.distortion,
            },
        }
    }
}

/// Reports cameras from which every one of these points lies in nearly the same direction: rays that meet at a smaller sine than
/// `least` locate nothing.
pub(crate) fn rays_meet(
    cameras: [&CameraModel; 2],
    points: &[Point2],
    least: f64,
    field: &Field,
    out: &mut Collector,
) {
    let sine = |p: &Point2| {
        let [a, b] = cameras.map(|c| [p.x_mm - c.position.x_mm, p.y_mm - c.position.y_mm]);
        let lengths = libm::hypot(a[0], a[1]) * libm::hypot(b[0], b[1]);
        ((a[0] * b[1] - a[1] * b[0]) / lengths).abs()
    };
    let largest = points.iter().map(sine).fold(0.0, f64::max);
    if points.is_empty() || largest >= least {
        return;
    }
    out.error(field.span, field.path.as_str(), "the rays of the cameras are nearly parallel at every location")
        .expected(format!("rays of the two cameras that meet at a sine of at least {least} (`analysis.min_ray_sine`) somewhere"))
        .found(format!("at most {largest:.4}"))
        .help("place the cameras apart, as in `skinrig new own-cameras`");
}
