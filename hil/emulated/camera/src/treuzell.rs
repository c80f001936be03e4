//! A camera with another protocol but the EVK1's vendor and product ID: drivers must leave it alone.

use std::sync::{Mutex, PoisonError};

use crate::control::Request;
use crate::usb::descriptors::Descriptors;
use crate::usb::function::{Function, Reply};
use crate::usb::usbfs::Setup;

/// An EVK3 as far as enumeration goes: interface subclass 0x19, three bulk endpoints (EVK1 reference, section 1.1).
pub(crate) struct Treuzell {
    descriptors: Descriptors,
    journal: Mutex<Vec<Request>>,
}

impl Treuzell {
    pub(crate) fn new() -> Self {
        Self {
            descriptors: Descriptors {
                vendor: 0x04b4,
                product: 0x00f4,
                interface_class: 0xff,
                interface_subclass: 0x19,
                endpoints: vec![0x82, 0x02, 0x81],
                speed_mbit: 5000,
                strings: [const { None }; 3],
            },
            journal: Mutex::default(),
        }
    }

    /// Vendor requests that reached it.
    pub(crate) fn journal(&self) -> Vec<Request> {
        self.journal
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}

impl Function for Treuzell {
    fn descriptors(&self) -> &Descriptors {
        &self.descriptors
    }

    fn control(&self, setup: Setup, data: &[u8]) -> Reply {
        if setup.is_vendor() {
            self.journal
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(Request::new(setup, data));
        }
        Reply::Stall
    }
}
