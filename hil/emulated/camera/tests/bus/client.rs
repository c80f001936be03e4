//! A minimal client: registers, start, stop, bytes.

use std::time::Duration;

use rusb::{Context, Device, DeviceHandle, UsbContext};
use skinrig_formats::Decoder;
use skinrig_model::{CdEvent, StreamFormat, TriggerEdge};

pub(crate) const SECOND: Duration = Duration::from_secs(1);
const CCAM2_CONTROL: u32 = 0x0008;
const ROI_CTRL: u32 = 0x0204;

/// Every device on the bus, in the order of the ports.
pub(crate) fn devices() -> Vec<Device<Context>> {
    let context = Context::new().expect("a bus");
    let mut all: Vec<_> = context.devices().expect("devices").iter().collect();
    all.sort_by_key(Device::address);
    all
}

pub(crate) struct Camera {
    pub handle: DeviceHandle<Context>,
    pub received: Vec<u8>,
}

impl Camera {
    /// The n-th device of the bus, claimed.
    pub(crate) fn open(n: usize) -> Self {
        let handle = devices()[n].open().expect("open");
        handle.claim_interface(0).expect("claim");
        Self {
            handle,
            received: Vec::new(),
        }
    }

    pub(crate) fn read(&self, address: u32) -> rusb::Result<u32> {
        let mut b = [0; 8];
        let (value, index) = (address as u16, (address >> 16) as u16);
        let n = self
            .handle
            .read_control(0xc0, 0x55, value, index, &mut b, SECOND)?;
        assert_eq!((n, b[0]), (8, 0x40), "status of a register read");
        Ok(u32::from_be_bytes([b[4], b[5], b[6], b[7]]))
    }

    pub(crate) fn write(&self, address: u32, value: u32) -> rusb::Result<()> {
        let (low, high) = (address as u16, (address >> 16) as u16);
        let n = self
            .handle
            .write_control(0x40, 0x56, low, high, &value.to_be_bytes(), SECOND)?;
        assert_eq!(n, 4);
        Ok(())
    }

    fn set(&self, address: u32, mask: u32, on: bool) {
        let before = self.read(address).expect("read");
        let after = if on { before | mask } else { before & !mask };
        self.write(address, after).expect("write");
    }

    /// Powers the sensor and enables all pixels; `sync` sets bits 12 and 14 of ATIS_CONTROL.
    pub(crate) fn configure(&self, sync: u32) {
        self.write(0x0000, 0x000c_0117 | sync).expect("power");
        self.write(0x0238, 1).expect("clock");
        self.write(CCAM2_CONTROL, 0x0920).expect("host interface");
        for n in 0..20 {
            self.write(0x0400 + 4 * n, u32::MAX).expect("columns");
        }
        for n in 0..15 {
            self.write(0x0500 + 4 * n, u32::MAX).expect("rows");
        }
        self.write(ROI_CTRL, 0x2b).expect("pixels");
    }

    pub(crate) fn start(&self) {
        self.set(CCAM2_CONTROL, 1 << 9, true);
    }

    pub(crate) fn stop(&self) {
        self.set(CCAM2_CONTROL, 1 << 9, false);
    }

    /// Runs one transfer and returns its data.
    pub(crate) fn transfer(&mut self) -> rusb::Result<usize> {
        let mut buffer = vec![0; 128 << 10];
        let n = self.handle.read_bulk(0x81, &mut buffer, SECOND)?;
        self.received.extend_from_slice(&buffer[..n]);
        Ok(n)
    }

    /// Receives until `enough` returns true for all data so far.
    pub(crate) fn read_until(
        &mut self,
        mut enough: impl FnMut(&StreamContent) -> bool,
    ) -> StreamContent {
        for _ in 0..20_000 {
            self.transfer().expect("bytes");
            let observed = StreamContent::decode(&self.received);
            if enough(&observed) {
                return observed;
            }
        }
        panic!(
            "condition not met by {:?}",
            StreamContent::decode(&self.received)
        );
    }
}

/// Content of a stream.
#[derive(Debug)]
pub(crate) struct StreamContent {
    pub events: Vec<CdEvent>,
    pub triggers: Vec<TriggerEdge>,
    pub last_us: u64,
}

impl StreamContent {
    pub(crate) fn decode(bytes: &[u8]) -> Self {
        let mut decoder = Decoder::new(StreamFormat::Evt2);
        let (mut events, mut triggers) = (Vec::new(), Vec::new());
        decoder.push_cd(bytes, &mut events, &mut triggers);
        Self {
            events,
            triggers,
            last_us: decoder.last_us().unwrap_or(0),
        }
    }
}
