//! Serves the system calls on an open device.

use std::io;
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::Arc;
use std::thread;

use rustix::io::Errno;

use super::function::{Function, Reply};
use super::queues::{FinishedTransfer, Queues, SubmittedTransfer};
use super::usbfs::{self, Setup, Transfer, URB_BYTES, Urb};
use super::wire::{IoctlRequest, Wire};

/// GET_DESCRIPTOR (USB 3.2 section 9.4.3).
const GET_DESCRIPTOR: u8 = 6;
/// Standard, device, IN.
const STANDARD_IN: u8 = 0x80;

/// One device on the bus.
#[derive(Clone)]
pub(crate) struct Node {
    pub function: Arc<dyn Function>,
    pub queues: Arc<Queues>,
}

/// Serves all processes that open the device, until the listener is shut down.
pub(crate) fn listen(node: Node, listener: UnixListener) -> io::Result<()> {
    thread::Builder::new()
        .name("usb node".into())
        .spawn(move || {
            while let Ok((stream, _)) = listener.accept() {
                let node = node.clone();
                let spawned = thread::Builder::new()
                    .name("usb file".into())
                    .spawn(move || node.serve(stream));
                if spawned.is_err() {
                    return;
                }
            }
        })
        .map(drop)
}

impl Node {
    fn serve(&self, stream: UnixStream) {
        let file = self.queues.open();
        let mut wire = Wire::new(stream);
        // A broken connection means that the process ended: close the device, like the kernel.
        while let Ok(Some(ioctl)) = wire.next() {
            if self.answer(file, &mut wire, ioctl).is_err() {
                break;
            }
        }
        self.queues.close(file);
    }

    fn answer(&self, file: u64, wire: &mut Wire, ioctl: IoctlRequest) -> io::Result<()> {
        let IoctlRequest { request, argument } = ioctl;
        let queues = &self.queues;
        let result = match request {
            usbfs::GET_CAPABILITIES => {
                wire.write_memory(argument, &usbfs::CAPABILITIES.to_ne_bytes())?;
                Ok(())
            }
            usbfs::CLAIM_INTERFACE | usbfs::DISCONNECT_CLAIM => queues.claim(file),
            usbfs::RELEASE_INTERFACE => queues.release(file),
            usbfs::GET_DRIVER => Err(Errno::NODATA),
            usbfs::SET_INTERFACE | usbfs::SET_CONFIGURATION | usbfs::RESET_ENDPOINT => {
                queues.plugged()
            }
            usbfs::CLEAR_HALT => {
                queues.clear_halt();
                queues.plugged()
            }
            usbfs::RESET => {
                if queues.reset() {
                    self.function.reset();
                    queues.plugged()
                } else {
                    Err(Errno::IO)
                }
            }
            usbfs::SUBMIT_URB => self.submit(file, wire, argument)?,
            usbfs::DISCARD_URB => queues.discard(file, argument),
            usbfs::REAP_URB_NO_DELAY => match queues.reap(file) {
                Ok(finished) => {
                    if !finished.bytes.is_empty() {
                        wire.write_memory(finished.to, &finished.bytes)?;
                    }
                    if finished.data {
                        queues.count(&finished.bytes);
                    }
                    wire.write_memory(finished.address, finished.urb.as_bytes())?;
                    wire.write_memory(argument, &finished.address.to_ne_bytes())?;
                    Ok(())
                }
                Err(errno) => Err(errno),
            },
            _ => Err(Errno::NOTTY),
        };
        wire.done(result)
    }

    fn submit(&self, file: u64, wire: &mut Wire, address: u64) -> io::Result<Result<(), Errno>> {
        let mut bytes = [0; URB_BYTES];
        bytes.copy_from_slice(&wire.read_memory(address, URB_BYTES)?);
        let mut urb = Urb::new(bytes);
        if let Err(errno) = self.queues.plugged() {
            return Ok(Err(errno));
        }
        let endpoints = &self.function.descriptors().endpoints;
        match urb.transfer() {
            Transfer::Control => {
                let all = wire.read_memory(urb.buffer(), urb.length())?;
                let Some((setup, data)) = all.split_first_chunk::<8>() else {
                    return Ok(Err(Errno::INVAL));
                };
                let setup = Setup::new(*setup);
                let (status, moved, bytes) = match self.control(setup, data) {
                    Reply::Silence => {
                        return Ok(self
                            .queues
                            .hold_control(file, SubmittedTransfer { address, urb }));
                    }
                    Reply::Stall => (-Errno::PIPE.raw_os_error(), 0, Vec::new()),
                    Reply::Done(mut bytes) if setup.is_in() => {
                        bytes.truncate(usize::from(setup.length));
                        (0, bytes.len(), bytes)
                    }
                    Reply::Done(_) => (0, data.len(), Vec::new()),
                };
                urb.finish(status, moved);
                let to = urb.buffer() + 8;
                Ok(self.queues.complete_control(
                    file,
                    FinishedTransfer {
                        address,
                        urb,
                        to,
                        bytes,
                        data: false,
                    },
                ))
            }
            Transfer::BulkIn(endpoint) if endpoints.contains(&endpoint) => {
                Ok(self.queues.submit(file, SubmittedTransfer { address, urb }))
            }
            Transfer::BulkIn(_) | Transfer::BulkOut(_) => Ok(Err(Errno::NOENT)),
            Transfer::Other => Ok(Err(Errno::INVAL)),
        }
    }

    fn control(&self, setup: Setup, data: &[u8]) -> Reply {
        if (setup.request_type, setup.request) == (STANDARD_IN, GET_DESCRIPTOR) {
            let [index, kind] = setup.value.to_le_bytes();
            let found = self.function.descriptors().get(kind, index);
            return found.map_or(Reply::Stall, Reply::Done);
        }
        self.function.control(setup, data)
    }
}
