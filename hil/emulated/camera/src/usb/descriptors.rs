//! Descriptors of a device (USB 3.2 section 9.6).

/// The descriptors of one device with one configuration and one interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Descriptors {
    pub vendor: u16,
    pub product: u16,
    pub interface_class: u8,
    pub interface_subclass: u8,
    /// Bulk endpoint addresses; bit 7 set: device to host.
    pub endpoints: Vec<u8>,
    /// Speed of the connection, Mbit/s: 480 or 5000.
    pub speed_mbit: u32,
    /// Manufacturer, product and serial strings, numbered 1, 2, 3.
    pub strings: [Option<String>; 3],
}

const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;
const STRING: u8 = 3;
const INTERFACE: u8 = 4;
const ENDPOINT: u8 = 5;
const COMPANION: u8 = 0x30;
const BULK: u8 = 2;

impl Descriptors {
    pub(crate) const fn is_super_speed(&self) -> bool {
        self.speed_mbit >= 5000
    }

    pub(crate) fn device(&self) -> [u8; 18] {
        let (release, packet_0) = if self.is_super_speed() {
            (0x0300u16, 9)
        } else {
            (0x0200, 64)
        };
        let [release, vendor, product] = [release, self.vendor, self.product].map(u16::to_le_bytes);
        let string = |n: usize| u8::from(self.strings[n].is_some()) * (n as u8 + 1);
        // bcdDevice is 0: no public dump of a real camera shows another value.
        [
            18,
            DEVICE,
            release[0],
            release[1],
            0,
            0,
            0,
            packet_0,
            vendor[0],
            vendor[1],
            product[0],
            product[1],
            0,
            0,
            string(0),
            string(1),
            string(2),
            1,
        ]
    }

    pub(crate) fn configuration(&self) -> Vec<u8> {
        let endpoints = self.endpoints.len() as u8;
        let mut bytes = vec![9, CONFIGURATION, 0, 0, 1, 1, 0, 0x80, 50];
        bytes.extend([9, INTERFACE, 0, 0, endpoints]);
        bytes.extend([self.interface_class, self.interface_subclass, 0, 0]);
        let packet: u16 = if self.is_super_speed() { 1024 } else { 512 };
        for &address in &self.endpoints {
            let [low, high] = packet.to_le_bytes();
            bytes.extend([7, ENDPOINT, address, BULK, low, high, 0]);
            if self.is_super_speed() {
                bytes.extend([6, COMPANION, 15, 0, 0, 0]);
            }
        }
        let [low, high] = (bytes.len() as u16).to_le_bytes();
        (bytes[2], bytes[3]) = (low, high);
        bytes
    }

    /// Reply to GET_DESCRIPTOR; `None` if the device does not have the descriptor.
    pub(crate) fn get(&self, kind: u8, index: u8) -> Option<Vec<u8>> {
        match (kind, index) {
            (DEVICE, 0) => Some(self.device().to_vec()),
            (CONFIGURATION, 0) => Some(self.configuration()),
            // The only language: English (United States).
            (STRING, 0) if self.strings.iter().any(Option::is_some) => Some(vec![4, STRING, 9, 4]),
            (STRING, 1..=3) => {
                let text = self.strings[usize::from(index) - 1].as_deref()?;
                let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
                let mut bytes = vec![units.len() as u8 + 2, STRING];
                bytes.extend(units);
                Some(bytes)
            }
            _ => None,
        }
    }
}
