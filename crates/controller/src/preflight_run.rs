//! The preflight of a run: its checks so far, and the probe of the camera streams while it checks them.

use skinrig_model::{DeviceIdentity, DeviceRole, PreflightCheck, RawChunk, Setting};

use crate::checks::{Preflight, device_checks};
use crate::stream_probe::StreamProbe;

/// A preflight in progress, if the run has one.
pub(crate) struct PreflightRun {
    preflight: Option<Preflight>,
    checks: Vec<PreflightCheck>,
    probe: Option<StreamProbe>,
}

impl PreflightRun {
    /// Starts with the caller's own checks; `None` for a run without preflight.
    pub(crate) fn new(preflight: Option<Preflight>) -> Self {
        let caller_checks = preflight.as_ref().map(|p| p.caller_checks.clone());
        Self {
            preflight,
            checks: caller_checks.unwrap_or_default(),
            probe: None,
        }
    }

    /// Checks identity and read-back settings of a device.
    pub(crate) fn check_device(
        &mut self,
        role: DeviceRole,
        identity: &DeviceIdentity,
        settings: &[Setting],
    ) {
        if let Some(preflight) = &self.preflight {
            let required = preflight.expected.iter().find(|e| e.role == role);
            let checks = device_checks(role, required, identity, settings);
            self.checks.extend(checks);
        }
    }

    /// Starts to probe the camera streams; returns what to check, if anything.
    pub(crate) fn begin_probe(&mut self) -> Option<Preflight> {
        let preflight = self.preflight.clone()?;
        self.probe = Some(StreamProbe::default());
        Some(preflight)
    }

    /// Processes the next chunk.
    pub(crate) fn observe(&mut self, chunk: &RawChunk) {
        if let Some(probe) = &mut self.probe {
            probe.observe(chunk);
        }
    }

    /// Whether the streams so far fulfil a condition.
    pub(crate) fn streams_fulfil(&self, condition: impl Fn(&StreamProbe) -> bool) -> bool {
        self.probe.as_ref().is_some_and(condition)
    }

    /// Adds checks of the streams so far.
    pub(crate) fn check_streams(&mut self, checks: impl Fn(&StreamProbe) -> [PreflightCheck; 2]) {
        self.checks.extend(self.probe.iter().flat_map(checks));
    }

    /// Ends the probe of the camera streams.
    pub(crate) fn end_probe(&mut self) {
        self.probe = None;
    }

    /// Takes the checks; `None` for a run without preflight.
    pub(crate) fn take_checks(&mut self) -> Option<Vec<PreflightCheck>> {
        self.preflight.as_ref()?;
        Some(std::mem::take(&mut self.checks))
    }
}
