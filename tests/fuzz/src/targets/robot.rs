//! A robot library with arbitrary answers: NaN, wrong values, errors.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use skinrig_drd_abi::{
    DEVICE_OMEGA3, DeviceId, ErrorCode, STATUS_CAPACITY, SdkVersion, StatusVector,
};
use skinrig_omega3::OmegaConfig;
use skinrig_omega3::brake::brake;
use skinrig_omega3::config::{InitialiseRule, Timeouts};
use skinrig_omega3::sdk::{
    CallError, CallResult, Generator, GeneratorLimits, Quantity, Reading, Sdk,
};
use skinrig_omega3::{enumerate, open};

/// Lists, opens, initialises and brakes a robot with such a library.
pub fn answers(bytes: &[u8]) {
    let sdk = FuzzedSdk(Mutex::new(bytes.to_vec()));
    if let Ok(found) = enumerate::list(&sdk) {
        for robot in &found {
            assert!(!robot.to_string().is_empty());
            let _ = robot.next_step();
        }
    }
    let config = OmegaConfig {
        initialise: InitialiseRule::SampleIsOff,
        timeouts: Timeouts {
            brake_attempts: 3,
            brake_retry: Duration::ZERO,
            ..Timeouts::default()
        },
        ..OmegaConfig::default()
    };
    match open::open(&sdk, &config, |_| Ok(())) {
        Ok(robot) => _ = brake(&sdk, robot.id, &config.timeouts, |_| ()),
        Err(e) => assert!(!e.into_device("77").to_string().is_empty()),
    }
}

/// Takes its answers from these bytes, and gives valid ones when they run out.
struct FuzzedSdk(Mutex<Vec<u8>>);

impl FuzzedSdk {
    fn take<const N: usize>(&self) -> Option<[u8; N]> {
        let mut left = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let head = left.first_chunk::<N>().copied()?;
        left.drain(..N);
        Some(head)
    }

    /// A quarter of the answers are errors, a quarter arbitrary, the rest valid.
    fn answer<T, const N: usize>(&self, good: T, any: impl Fn([u8; N]) -> T) -> CallResult<T> {
        match self.take::<1>().map(|[choice]| choice % 4) {
            Some(0) => Err(CallError {
                call: "hostile",
                code: ErrorCode(i32::from_le_bytes(self.take().unwrap_or_default())),
                text: String::from_utf8_lossy(&self.take::<8>().unwrap_or_default()).into_owned(),
            }),
            Some(1) => Ok(self.take().map_or(good, any)),
            _ => Ok(good),
        }
    }

    fn succeeds_or(&self, good: bool) -> bool {
        self.take::<1>()
            .map_or(good, |[choice]| (choice % 4 == 1) != good)
    }

    fn done(&self) -> CallResult<()> {
        self.answer((), |_: [u8; 0]| ())
    }

    fn real(&self, good: f64) -> CallResult<f64> {
        self.answer(good, f64::from_le_bytes)
    }

    fn vector(&self) -> CallResult<[f64; 3]> {
        Ok([self.real(0.0)?, self.real(0.0)?, self.real(0.0)?])
    }

    fn reading(&self) -> CallResult<Reading> {
        Ok(Reading {
            position_m: self.vector()?,
            cached: self.succeeds_or(false),
        })
    }
}

impl Sdk for FuzzedSdk {
    fn version(&self) -> SdkVersion {
        let number = || self.answer(10, i32::from_le_bytes).unwrap_or_default();
        SdkVersion::new(number(), number(), number())
    }
    fn device_count(&self) -> CallResult<i8> {
        self.answer(1, i8::from_le_bytes)
    }
    fn open(&self, index: i8) -> CallResult<DeviceId> {
        self.answer(index, i8::from_le_bytes)
    }
    fn close(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn system_type(&self, _: DeviceId) -> CallResult<i32> {
        self.answer(DEVICE_OMEGA3, i32::from_le_bytes)
    }
    fn system_name(&self, _: DeviceId) -> Option<String> {
        let name = self.take::<16>()?;
        Some(String::from_utf8_lossy(&name).into_owned())
    }
    fn serial(&self, _: DeviceId) -> CallResult<u16> {
        self.answer(77, u16::from_le_bytes)
    }
    fn firmware(&self, _: DeviceId) -> CallResult<f64> {
        self.real(3.0)
    }
    fn com_mode(&self, _: DeviceId) -> CallResult<i32> {
        self.answer(1, i32::from_le_bytes)
    }
    fn check_memory(&self, _: DeviceId) -> Option<CallResult<()>> {
        Some(self.done())
    }
    fn status(&self, _: DeviceId) -> CallResult<StatusVector> {
        let mut words = [0; STATUS_CAPACITY];
        for word in &mut words[..17] {
            *word = self.answer(0, i32::from_le_bytes)?;
        }
        // Power, and no error.
        words[0] = self.answer(1, i32::from_le_bytes)?;
        Ok(StatusVector::from_words(&words))
    }
    fn is_supported(&self, _: DeviceId) -> bool {
        self.succeeds_or(true)
    }
    fn is_initialized(&self, _: DeviceId) -> bool {
        self.succeeds_or(true)
    }
    fn auto_init(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn set(&self, _: DeviceId, _: Quantity, _: f64) -> Option<CallResult<()>> {
        self.succeeds_or(true).then(|| self.done())
    }
    fn get(&self, _: DeviceId, _: Quantity) -> Option<CallResult<f64>> {
        self.succeeds_or(true).then(|| self.real(0.0))
    }
    fn compensate_gravity(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn enable_expert_mode(&self) -> CallResult<()> {
        self.done()
    }
    fn watchdog(&self, _: DeviceId) -> CallResult<u8> {
        self.answer(80, u8::from_le_bytes)
    }
    fn set_watchdog(&self, _: DeviceId, _: u8) -> CallResult<()> {
        self.done()
    }
    fn velocity_threshold(&self, _: DeviceId) -> CallResult<u32> {
        self.answer(40, u32::from_le_bytes)
    }
    fn start(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn stop(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn is_running(&self, _: DeviceId) -> bool {
        self.succeeds_or(false)
    }
    fn control_khz(&self, _: DeviceId) -> CallResult<f64> {
        self.real(4.0)
    }
    fn regulate_position(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn enable_filter(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn is_filtering(&self, _: DeviceId) -> bool {
        self.succeeds_or(true)
    }
    fn set_generator_limits(
        &self,
        _: DeviceId,
        _: Generator,
        _: GeneratorLimits,
    ) -> CallResult<()> {
        self.done()
    }
    fn generator_limits(&self, _: DeviceId, _: Generator) -> CallResult<GeneratorLimits> {
        Ok(GeneratorLimits {
            acceleration_m_s2: self.real(1.0)?,
            speed_m_s: self.real(1.0)?,
            jerk_m_s3: self.real(1.0)?,
        })
    }
    fn track(&self, _: DeviceId, _: [f64; 3]) -> CallResult<()> {
        self.done()
    }
    fn regulated_position(&self, _: DeviceId) -> CallResult<Reading> {
        self.reading()
    }
    fn position(&self, _: DeviceId) -> CallResult<Reading> {
        self.reading()
    }
    fn force(&self, _: DeviceId) -> CallResult<[f64; 3]> {
        self.vector()
    }
    fn emergency_stop(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
    fn force_off(&self, _: DeviceId) -> CallResult<()> {
        self.done()
    }
}
