//! Tests of the driver: on a model of the camera, and on an emulated bus with libusb.

mod bus;
mod driver;
