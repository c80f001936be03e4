//! The trigger box over a serial port: coded pulses, time-stamped inputs, the box's own clock.
