//! Tables by hand.
use skinrig_model::Point2;
use skinrig_settings::Setting;
use skinrig_settings::{Key, Need, Settings, Shape, Table};
pub(crate) const fn required(name: &'static str, shape: Shape, doc: &'static str) -> Key {
    Key {
        name,
        doc,
        shape,
        need: Need::Required,
    }
}
pub(crate) const fn optional(name: &'static str, shape: Shape, doc: &'static str) -> Key {
    Key {
        name,
        doc,
        shape,
        need: Need::Optional,
    }
}
pub(crate) const fn default(
    name: &'static str,
    shape: Shape,
    value: &'static str,
    doc: &'static str,
) -> Key {
    Key {
        name,
        doc,
        shape,
        need: Need::Default(value),
    }
}
pub(crate) const fn count(min: i64, max: i64) -> Shape {
    Shape::Whole { min, max }
}
pub(crate) static POINT_ITEM: Shape = Point2::SHAPE;
pub(crate) const ROI: &Table = super::Roi::TABLE;
pub(crate) const NOMINAL_CAMERA: &Table = super::NominalCamera::TABLE;
