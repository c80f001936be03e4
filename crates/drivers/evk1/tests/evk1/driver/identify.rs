//! Any device but a streaming-capable EVK1 Gen3.1 is rejected with a reason before any write.

use skinrig_evk1::requests;
use skinrig_evk1::{Evk1Config, UsbError};

use super::model::Bench;

fn refusal(spoil: impl FnOnce(&Bench)) -> String {
    let bench = Bench::new();
    spoil(&bench);
    let error = bench.open().err().expect("an error");
    assert_eq!(bench.writes(), [], "nothing may be written");
    error.to_string()
}

fn answering(code: u8, word: u16) -> String {
    refusal(|bench| {
        bench.model().faults.answers.insert(code, word);
    })
}

#[test]
fn other_devices_are_rejected_by_name() {
    let found = [
        answering(requests::BOARD_VERSION, 3),
        answering(requests::FPGA_BOOT_STATE, 0),
        answering(requests::SYSTEM_ID, 0x11),
        answering(requests::SYSTEM_ID, 0x1a),
        answering(requests::SYSTEM_ID, 0x31),
        refusal(|b| b.model().faults.read_status = Some(0x12)),
        refusal(|b| b.model().faults.error = Some(UsbError::Gone)),
    ];
    insta::assert_snapshot!(found.join("\n"), @r"
model: not an EVK1 Gen3.1: expected board version 2, found board version 3
expected the FPGA to be configured within 10 s, found it still booting: power the camera off and on
model: not an EVK1 Gen3.1: expected system ID 0x1c, found 0x11, the rescue image of the FPGA: update the camera's flash with the manufacturer's tool
model: not an EVK1 Gen3.1: expected system ID 0x1c, found 0x1a, an EVK1 Gen4
model: not an EVK1 Gen3.1: expected system ID 0x1c, found 0x31, an unknown system
reading SERIAL_MSB (0x0020): expected status 0x40, found 0x12
reading the board version: the device is no longer on the bus: check cable and power
");
}

#[test]
fn an_inconsistent_configuration_is_rejected() {
    let config = Evk1Config {
        chunk_bytes: 1 << 16,
        ..Evk1Config::default()
    };
    let error = Bench::new().open_with(config).err().expect("an error");
    insta::assert_snapshot!(error, @r"
expected chunk_bytes from transfer_bytes to 64 MiB, found 65536
");
}
