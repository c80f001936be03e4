//! Cameras and trigger box of a bench, each from its own keys.

use super::build::Places;
use super::{BoxSetup, CameraSetup, SyncRole};
use crate::build::{biases, nominal_camera, roi};
use crate::shape::{Field, Keys, Value};
use skinrig_model::Point2;
use skinrig_settings::Collector;

/// The EVK1's trigger input that its sync line uses when it is a slave.
const AUXILIARY: u8 = 7;

/// Camera 1 and camera 2, with what must hold between them.
pub(super) fn cameras(
    f: &Field,
    places: &Places<'_>,
    out: &mut Collector,
) -> Option<[CameraSetup; 2]> {
    let mut camera = |key| f.get(key).and_then(|c| camera(c, places, out));
    let [Some(one), Some(two)] = [camera("camera1"), camera("camera2")] else {
        return None;
    };
    let second = f.get("camera2")?;
    if one.serial == two.serial {
        let span = second.get("serial").map_or(second.span, |s| s.span);
        out.error(span, "cameras.camera2.serial", "both cameras are the same")
            .expected("two different serial numbers")
            .found(format!("`{}` twice", one.serial));
    }
    let pair = (one.sync, two.sync);
    let fits = matches!(
        pair,
        (SyncRole::Standalone, SyncRole::Standalone)
            | (SyncRole::Master, SyncRole::Slave)
            | (SyncRole::Slave, SyncRole::Master)
    );
    if !fits {
        let span = second.get("sync").map_or(second.span, |s| s.span);
        out.error(span, "cameras.camera2.sync", "the sync modes do not fit")
            .expected("both `standalone`, or one `master` and one `slave`")
            .found(format!("{:?} and {:?}", pair.0, pair.1).to_lowercase());
    }
    if out.is_clean() && one.trigger_channel != two.trigger_channel {
        let span = second
            .get("trigger_channel")
            .map_or(second.span, |s| s.span);
        out.error(
            span,
            "cameras.camera2.trigger_channel",
            "the trigger channels differ",
        )
        .expected("the same channel on both cameras: analyses read one")
        .found(format!(
            "{} and {}",
            one.trigger_channel, two.trigger_channel
        ));
    }
    Some([one, two])
}

/// A trigger box needs a trigger input on both cameras.
pub(super) fn wired(cameras: &[CameraSetup; 2], trigger_box: &Field, out: &mut Collector) {
    if let Some(camera) = cameras.iter().find(|c| !c.has_trigger()) {
        out.error(
            trigger_box.span,
            trigger_box.path.as_str(),
            "a camera cannot see the trigger box",
        )
        .expected("two cameras whose driver offers a trigger input: `evk1` or `evk4`")
        .found(format!("`model: {}`", camera.model))
        .help("leave `trigger_box` out: the cameras' times are then tied to nothing, and sessions cannot be labelled by marks");
    }
}

fn camera(f: &Field, places: &Places<'_>, out: &mut Collector) -> Option<CameraSetup> {
    let bias_file = f.get("bias_file").map(|b| places.path(b, out));
    let read_back_exceptions = f
        .get("read_back_exceptions")
        .and_then(|list| addresses(list, out));
    let read_status = f.get("read_status").and_then(|list| bytes(list, out));
    let roi = f.get("roi").map(|r| roi(r, out));
    let sync = match f.word("sync")? {
        "master" => SyncRole::Master,
        "slave" => SyncRole::Slave,
        _ => SyncRole::Standalone,
    };
    let model = f.word("model")?;
    let channel = f.get("trigger_channel")?;
    let trigger_channel = f
        .count("trigger_channel")
        .and_then(|c| u8::try_from(c).ok())?;
    let delay = f.get("trigger_delay")?;
    let delay_us = f.quantity("trigger_delay")? * 1e6;
    if (delay_us - delay_us.round()).abs() > 1e-6 {
        out.error(
            delay.span,
            delay.path.as_str(),
            "cameras stamp edges in whole microseconds",
        )
        .expected("whole microseconds, such as `3 us`")
        .found(format!("{delay_us} us"));
    }
    if model == "evk1" && ![0, 6, AUXILIARY].contains(&trigger_channel) {
        out.error(
            channel.span,
            channel.path.as_str(),
            "the EVK1 has no such trigger input",
        )
        .expected("0 (main), 6 (loop-back of its own output) or 7 (auxiliary)")
        .found(trigger_channel.to_string());
    }
    if model == "evk1" && sync == SyncRole::Slave && trigger_channel == AUXILIARY {
        out.error(
            channel.span,
            channel.path.as_str(),
            "a slave's auxiliary input carries the sync clock",
        )
        .expected("0, the main trigger input")
        .found(trigger_channel.to_string());
    }
    if let (Some(gap), true) = (f.get("max_time_high_gap"), model != "evk1") {
        out.error(
            gap.span,
            gap.path.as_str(),
            "the camera's time base is not watched",
        )
        .expected("`max_time_high_gap` with `model: evk1` only")
        .found(format!("`model: {model}`"));
    }
    let untriggered = matches!(model, "evk3_hd" | "silky_vga");
    if untriggered && sync != SyncRole::Standalone {
        let span = f.get("sync").map_or(f.span, |s| s.span);
        out.error(
            span,
            format!("{}.sync", f.path),
            "the camera's driver shares no time base",
        )
        .expected(format!("`standalone` for `model: {model}`"))
        .found(format!("`{sync:?}`").to_lowercase());
    }
    let nominal = f.get("geometry")?;
    if nominal.get("aim").is_none() {
        out.error(
            nominal.span,
            nominal.path.as_str(),
            "where the camera aims is missing",
        )
        .expected("`aim`: a rig file knows no outline whose centre could stand for it")
        .found("no such key")
        .help("add `aim: [10 mm, 2 mm]`, the point that the camera's axis goes through");
        return None;
    }
    let geometry = nominal_camera(nominal, Point2::new(0.0, 0.0))?;
    Some(CameraSetup {
        model,
        serial: f.text("serial")?,
        fpga: f.text("fpga"),
        biases: f.get("biases").map(biases).unwrap_or_default(),
        bias_file: bias_file.map_or(Some(None), |b| b.map(Some))?,
        roi: roi.map_or(Some(None), |r| r.map(Some))?,
        noise_filter_ev_s: f.quantity("noise_filter").map(|r| r.round() as u32),
        read_back_exceptions: read_back_exceptions?,
        read_status: read_status?,
        failed_reset_is_accepted: f.word("failed_reset")? == "accepted",
        failed_transfer_is_loss: f.word("failed_transfers")? == "loss",
        tolerant: false,
        max_time_high_gap_us: f
            .quantity("max_time_high_gap")
            .map(|s| (s * 1e6).round() as u64),
        overflow_is_loss: f.word("overflow_counter")? == "loss",
        sync,
        trigger_channel,
        trigger_delay_us: delay_us.round() as u16,
        geometry,
    })
}

/// Bytes, hexadecimal.
fn bytes(list: &Field, out: &mut Collector) -> Option<Vec<u8>> {
    let words = addresses(list, out)?;
    let mut bytes = Vec::new();
    for (word, item) in words.into_iter().zip(list.items()) {
        let Ok(byte) = u8::try_from(word) else {
            out.error(item.span, item.path.as_str(), "not a byte")
                .expected("`0x00` to `0xff`")
                .found(format!("`{word:#x}`"));
            return None;
        };
        bytes.push(byte);
    }
    Some(bytes)
}

/// Register addresses, hexadecimal.
fn addresses(list: &Field, out: &mut Collector) -> Option<Vec<u32>> {
    let mut addresses = Vec::new();
    for item in list.items() {
        let Value::Text(text) = &item.value else {
            return None;
        };
        let hex = text.strip_prefix("0x").map(|h| u32::from_str_radix(h, 16));
        let Some(Ok(address)) = hex else {
            out.error(item.span, item.path.as_str(), "not an address")
                .expected("a hexadecimal number such as `0x0204`")
                .found(format!("`{text}`"));
            return None;
        };
        addresses.push(address);
    }
    Some(addresses)
}

pub(super) fn trigger_box(f: &Field, places: &Places<'_>, out: &mut Collector) -> Option<BoxSetup> {
    let port = f.get("port").and_then(|p| places.text(p, out));
    let wiring = f.get("wiring")?;
    let output = |key| wiring.word(key);
    let outputs = [output("output1")?, output("output2")?, output("output3")?];
    let lines = |camera| outputs.iter().filter(|o| **o == camera).count();
    if let Some(camera) = ["camera1", "camera2"].into_iter().find(|c| lines(*c) != 1) {
        out.error(
            wiring.span,
            wiring.path.as_str(),
            "a camera's trigger line is not clear",
        )
        .expected(format!("exactly one output that goes to `{camera}`"))
        .found(lines(camera).to_string());
    }
    Some(BoxSetup {
        port: port?,
        serial: f.text("serial"),
        firmware: f.text("firmware"),
        outputs,
        input: wiring.word("input")?,
        // In range by the key.
        sync_period_ms: (f.quantity("sync_period")? * 1e3).round() as u16,
        max_drift_ppm: f.number("max_drift_ppm")?,
    })
}
