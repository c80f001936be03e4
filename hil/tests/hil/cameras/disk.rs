//! Check `disk`.

use std::fs;
use std::path::Path;

use skinrig_model::SimLevel;
use skinrig_nightly::EvidenceKind;

use crate::cameras::bench::{SimBench, kinds_and_subjects, number, value};

const DISK: &str = "disk: {amount: 10 MB, write_rate: {at_least: 1 MB/s}}";
const TOO_MUCH: &str = "disk: {amount: 100 GB, write_rate: {at_least: 1 MB/s}}";

fn bench(folder: &Path) -> SimBench {
    let mut bench = SimBench::new(SimLevel::Kinematic, Vec::new());
    bench.folder = folder.to_owned();
    bench
}

/// A temporary folder, removed on drop.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("skinrig-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn written_data_read_back_and_no_file_remains() {
    let folder = Folder::new("disk-well");
    let inner = folder.0.join("sessions"); // does not exist yet
    let found = bench(&inner).run_check(DISK);
    assert_eq!(found.evidence, []);
    assert!(number(&found, "computer", "write_rate") > 0.0);
    assert!(number(&found, "computer", "free") > 10e6);
    assert_eq!(fs::read_dir(&inner).unwrap().count(), 0);
}

#[test]
fn a_disk_that_is_too_small_is_left_alone() {
    let folder = Folder::new("disk-small");
    let free = number(&bench(&folder.0).run_check(DISK), "computer", "free");
    if free > 100e9 {
        return; // this disk has enough space
    }
    let found = bench(&folder.0).run_check(TOO_MUCH);
    assert_eq!(value(&found, "computer", "write_rate").value, None);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::Disk, "computer")]
    );
    assert!(found.evidence[0].next.is_some());
}

#[test]
fn an_unusable_folder_is_reported_with_the_next_step() {
    let folder = Folder::new("disk-file");
    let file = folder.0.join("file");
    fs::write(&file, "").unwrap();
    let found = bench(&file.join("sessions")).run_check(DISK);
    assert_eq!(value(&found, "computer", "write_rate").value, None);
    assert_eq!(value(&found, "computer", "free").value, None);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::Disk, "computer")]
    );
    let next = found.evidence[0].next.clone().unwrap();
    assert!(next.contains("--sessions"), "{next}");
}
