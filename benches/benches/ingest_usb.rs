//! Highest event rate of two cameras without losses on the way to the session file, compared with a plain file.
//!
//! The cameras are emulated and stream in real time from this process; a second process runs the driver, libusb and the
//! recorder, as in production. `SKINRIG_BENCH_SECONDS` sets the length of a trial (default 5).
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("ingest_usb: skipped: expected Linux, whose USB file system is emulated here");
}

#[cfg(target_os = "linux")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    match std::env::var(linux::JOB) {
        Ok(job) => linux::record(&job),
        Err(_) => linux::measure(),
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeMap;
    use std::error::Error;
    use std::path::Path;
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    use serde_json::{Value, json};
    use skinrig_bench::session::{header, plain_file};
    use skinrig_device::{CameraSettings, EventCamera, RealClock};
    use skinrig_emulated_camera::config::{Content, Pacing};
    use skinrig_emulated_camera::{Bus, BusConfig, Evk1Config as Emulated};
    use skinrig_evk1::{Evk1, Evk1Config};
    use skinrig_model::{AttemptId, CameraId, HostTime, PressId, Record};
    use skinrig_recorder::SessionWriter;

    /// Environment variable with the job of the recording process.
    pub(crate) const JOB: &str = "SKINRIG_BENCH_JOB";

    const SERIALS: [&str; 2] = ["00001621", "00001622"];
    /// Maximum rate of the sensor, and end of the search, Mev/s per camera.
    const HIGHEST: f64 = 50.0;
    /// Resolution of the search, Mev/s per camera.
    const STEP: f64 = 1.0;
    const BYTES_PER_EVENT: f64 = 4.0;
    /// Small compared with a trial, so that an excessive rate shows as loss.
    const BACKLOG: usize = 32 << 20;
    const SEGMENT_MB: u64 = 1024;

    /// Destination of the bytes.
    #[derive(Clone, Copy, PartialEq, Eq)]
    enum Sink {
        Nowhere,
        Session,
    }

    impl Sink {
        fn name(self) -> &'static str {
            match self {
                Self::Nowhere => "nowhere",
                Self::Session => "session",
            }
        }
    }

    /// A rate, Mev/s per camera, and its trial.
    type BestTrial = Option<(f64, Trial)>;

    /// Result of a trial.
    struct Trial {
        /// Bytes sent, and bytes lost: at the camera, and on the host.
        made: u64,
        dropped: u64,
        lost: u64,
        seconds: f64,
        /// CPU seconds by thread.
        threads: Vec<(String, f64)>,
    }

    impl Trial {
        fn is_loss_free(&self) -> bool {
            self.dropped == 0 && self.lost == 0
        }

        fn mb_per_s(&self) -> f64 {
            (self.made - self.dropped - self.lost) as f64 / 1e6 / self.seconds
        }
    }

    pub(crate) fn measure() -> Result<(), Box<dyn Error>> {
        let seconds: f64 = match std::env::var("SKINRIG_BENCH_SECONDS") {
            Ok(text) => text.parse()?,
            Err(_) => 5.0,
        };
        let folder = tempfile::tempdir()?;
        let chunk: Vec<u8> = (0..1u32 << 18)
            .flat_map(|n| n.wrapping_mul(0x9e37_79b9).to_le_bytes())
            .collect();
        let mut plain = f64::INFINITY;
        for _ in 0..3 {
            let begun = Instant::now();
            plain_file(&folder.path().join("plain"), &chunk, SEGMENT_MB)?;
            plain = plain.min(begun.elapsed().as_secs_f64());
        }
        std::fs::remove_file(folder.path().join("plain"))?;
        let plain = (SEGMENT_MB << 20) as f64 / 1e6 / plain;
        println!("\ntwo emulated cameras through libusb and the driver, trials of {seconds} s");
        println!("  plain file, one fsync at the end: {plain:.0} MB/s (best of 3), the baseline");
        for sink in [Sink::Nowhere, Sink::Session] {
            let label = match sink {
                Sink::Nowhere => "driver alone",
                Sink::Session => "driver and session file",
            };
            let free = trial(folder.path(), sink, HIGHEST, Pacing::HostTime, seconds)?;
            println!(
                "  {label}: {:.0} MB/s ({:.2} x) when the cameras wait for the host",
                free.mb_per_s(),
                free.mb_per_s() / plain
            );
            report_threads(&free);
            let [found, beyond] = search(folder.path(), sink, seconds)?;
            match found {
                Some((rate, best)) => {
                    let mb = 2.0 * rate * BYTES_PER_EVENT;
                    println!(
                        "  {label}: highest loss-free rate in real time 2 x {rate:.0} Mev/s = {mb:.0} MB/s of events ({:.2} x){}",
                        best.mb_per_s() / plain,
                        if rate < HIGHEST {
                            ""
                        } else {
                            ", the sensor's maximum"
                        }
                    );
                    report_threads(&best);
                }
                None => println!("  {label}: loses events at 2 x {STEP:.0} Mev/s already"),
            }
            if let Some((rate, trial)) = beyond {
                println!(
                    "    at 2 x {rate:.0} Mev/s {:.1} MB found no transfer at the camera, {:.1} MB no place in the driver's backlog",
                    trial.dropped as f64 / 1e6,
                    trial.lost as f64 / 1e6
                );
            }
        }
        println!(
            "  method: emulator and recording process share this machine's processors; loss is counted by the cameras \
             (FIFO of 512 KiB) and by the driver (backlog of {} MiB)",
            BACKLOG >> 20
        );
        Ok(())
    }

    /// The highest rate without loss, to [`STEP`], each tried twice; and the lowest with loss.
    fn search(folder: &Path, sink: Sink, seconds: f64) -> Result<[BestTrial; 2], Box<dyn Error>> {
        let (mut low, mut high) = (0.0, HIGHEST);
        let (mut holds, mut loses) = (None, None);
        let mut rate = HIGHEST;
        while high - low > STEP || loses.is_none() {
            let mut tried = trial(folder, sink, rate, Pacing::RealTime, seconds)?;
            if !tried.is_loss_free() {
                // A single loss may be a hiccup of the machine.
                tried = trial(folder, sink, rate, Pacing::RealTime, seconds)?;
            }
            if tried.is_loss_free() {
                (low, holds) = (rate, Some((rate, tried)));
                if rate >= HIGHEST {
                    break;
                }
            } else {
                (high, loses) = (rate, Some((rate, tried)));
            }
            rate = f64::midpoint(low, high).round();
        }
        Ok([holds, loses])
    }

    fn report_threads(trial: &Trial) {
        let busy = trial
            .threads
            .iter()
            .filter(|(_, s)| *s > 0.05 * trial.seconds);
        let parts: Vec<String> = busy
            .map(|(name, s)| format!("{name} {:.0} %", 100.0 * s / trial.seconds))
            .collect();
        println!("    processor time by thread: {}", parts.join(", "));
    }

    fn trial(
        folder: &Path,
        sink: Sink,
        mev_per_s: f64,
        pacing: Pacing,
        seconds: f64,
    ) -> Result<Trial, Box<dyn Error>> {
        let camera = |serial: &str| Emulated {
            content: Content::Dense { mev_per_s },
            pacing,
            ..Emulated::new(serial)
        };
        let devices = SERIALS.map(|s| camera(s).into()).to_vec();
        let bus = Bus::start(&BusConfig { devices })?;
        let before = threads("emulator")?;
        let job = json!({ "sink": sink.name(), "seconds": seconds,
            "path": folder.join("bench.session") });
        let mut child = bus.command(std::env::current_exe()?)?;
        let mut child = child
            .env(JOB, job.to_string())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        // Threads that serve the cameras end with the process, so measure them while it runs.
        let mut spent = BTreeMap::new();
        while child.try_wait()?.is_none() {
            for (name, seconds) in threads("emulator")? {
                let before = before.get(&name).unwrap_or(&0.0);
                let most: &mut f64 = spent.entry(name).or_insert(0.0);
                *most = most.max(seconds - before);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let output = child.wait_with_output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let result: Value = serde_json::from_slice(&output.stdout)?;
        let recording: BTreeMap<String, f64> = serde_json::from_value(result["threads"].clone())?;
        spent.extend(recording);
        let mut threads: Vec<(String, f64)> = spent.into_iter().collect();
        threads.sort_by(|a, b| b.1.total_cmp(&a.1));
        let remote = bus.remote()?;
        let (mut made, mut dropped) = (0, 0);
        for serial in SERIALS {
            let counters = remote.observe(serial)?.counters;
            made += counters.made_bytes;
            dropped += counters.dropped_bytes;
        }
        Ok(Trial {
            made,
            dropped,
            lost: result["lost"].as_u64().ok_or("expected the bytes lost")?,
            seconds: result["seconds"]
                .as_f64()
                .ok_or("expected the time taken")?,
            threads,
        })
    }

    /// The recording process: both cameras into the sink.
    pub(crate) fn record(job: &str) -> Result<(), Box<dyn Error>> {
        let job: Value = serde_json::from_str(job)?;
        let span = Duration::from_secs_f64(job["seconds"].as_f64().ok_or("expected seconds")?);
        let path = job["path"].as_str().ok_or("expected a path")?;
        let mut writer = if job["sink"] == Sink::Session.name() {
            for end in ["", "-wal", "-shm"] {
                let _ = std::fs::remove_file(format!("{path}{end}"));
            }
            let mut writer = SessionWriter::create(path)?;
            writer.accept(Record::Started(Box::new(header())))?;
            Some(writer)
        } else {
            None
        };
        let config = Evk1Config {
            backlog_bytes: BACKLOG,
            ..Evk1Config::default()
        };
        let clock = RealClock::start();
        let mut cameras = Vec::new();
        for (serial, id) in SERIALS.into_iter().zip(CameraId::ALL) {
            let mut camera = Evk1::open_serial(serial, id, config.clone(), clock)?;
            camera.configure(&CameraSettings::default())?;
            cameras.push(camera);
        }
        // Together: the first must not stream during the second's half-second start.
        std::thread::scope(|scope| {
            let starting: Vec<_> = cameras
                .iter_mut()
                .map(|camera| scope.spawn(|| camera.start()))
                .collect();
            starting.into_iter().try_for_each(|thread| {
                let started = thread.join().map_err(|_| "a start panicked")?;
                started.map_err(Box::<dyn Error>::from)
            })
        })?;
        let begun = Instant::now();
        let (mut chunks, mut lost) = (Vec::new(), 0);
        let (mut stopping, mut spent) = (false, BTreeMap::new());
        while !stopping {
            stopping = begun.elapsed() >= span;
            if stopping {
                // The stream's threads end with it.
                spent = threads("host")?;
            }
            for camera in &mut cameras {
                if stopping {
                    camera.stop(&mut chunks)?;
                } else {
                    camera.poll(&mut chunks)?;
                }
            }
            if chunks.is_empty() {
                // Same as the controller's step.
                std::thread::sleep(Duration::from_millis(1));
            }
            for chunk in chunks.drain(..) {
                lost += chunk.lost_before;
                if let Some(writer) = &mut writer {
                    writer.accept(Record::Chunk(chunk))?;
                }
            }
        }
        if let Some(writer) = &mut writer {
            // Returns when all previous records are on the disk.
            let (press, number) = (PressId::from_index(0), 1);
            writer.accept(Record::Intent {
                attempt: AttemptId { press, number },
                t: HostTime(0),
            })?;
        }
        let result = json!({ "lost": lost, "seconds": begun.elapsed().as_secs_f64(),
            "threads": spent });
        println!("{result}");
        Ok(())
    }

    /// CPU seconds used by the threads of this process, summed by name.
    fn threads(process: &str) -> Result<BTreeMap<String, f64>, Box<dyn Error>> {
        /// Clock ticks on all common Linux systems.
        const TICKS_PER_S: f64 = 100.0;
        let mut spent = BTreeMap::new();
        for entry in std::fs::read_dir("/proc/self/task")? {
            let folder = entry?.path();
            let (Ok(name), Ok(stat)) = (
                std::fs::read_to_string(folder.join("comm")),
                std::fs::read_to_string(folder.join("stat")),
            ) else {
                continue;
            };
            // After the name in parentheses: state is field 3, user and system time are fields 14 and 15.
            let after = stat.rsplit_once(") ").map_or("", |(_, after)| after);
            let ticks: f64 = after
                .split(' ')
                .skip(11)
                .take(2)
                .filter_map(|t| t.parse::<f64>().ok())
                .sum();
            let name = format!("{process}: {}", name.trim());
            *spent.entry(name).or_insert(0.0) += ticks / TICKS_PER_S;
        }
        Ok(spent)
    }
}
