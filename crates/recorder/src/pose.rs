//! Pose samples as the 64-byte records of `pose_block.data`.

use skinrig_model::{HostTime, Point3, PoseSample, Skin};

/// Bytes of one sample.
pub(crate) const SAMPLE_BYTES: usize = 64;

/// Appends `sample` to `data`.
pub(crate) fn encode(sample: &PoseSample, data: &mut Vec<u8>) {
    data.extend_from_slice(&sample.t.0.to_le_bytes());
    for value in [sample.commanded.to_array(), sample.measured.to_array()].as_flattened() {
        data.extend_from_slice(&value.to_le_bytes());
    }
    data.extend_from_slice(&sample.force_n.to_le_bytes());
}

/// Samples of a block. Ignores bytes after the last whole record: the caller checks the length.
pub(crate) fn decode(data: &[u8]) -> Vec<PoseSample> {
    data.as_chunks::<SAMPLE_BYTES>()
        .0
        .iter()
        .map(|record| {
            let (words, _) = record.as_chunks::<8>();
            let at = |i: usize| f64::from_le_bytes(words[i]);
            let point = |i: usize| Point3::<Skin>::new(at(i), at(i + 1), at(i + 2));
            PoseSample {
                t: HostTime(i64::from_le_bytes(words[0])),
                commanded: point(1),
                measured: point(4),
                force_n: at(7),
            }
        })
        .collect()
}
