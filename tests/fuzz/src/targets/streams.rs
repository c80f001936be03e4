//! Camera bytes: words of every format, and folded chunks.

use skinrig_formats::codec;
use skinrig_formats::{Decoder, EventSink, Scanner};
use skinrig_model::{CdEvent, StreamFormat, TriggerEdge};

struct NullSink;

impl EventSink for NullSink {
    fn on_cd(&mut self, _: &[CdEvent]) {}
    fn on_trigger(&mut self, _: TriggerEdge) {}
}

/// The first byte selects the format and where the words are split; the device restarts in between.
pub fn any_format(bytes: &[u8]) {
    let Some((choice, words)) = bytes.split_first() else {
        return;
    };
    let format = [
        StreamFormat::Evt2,
        StreamFormat::Evt21,
        StreamFormat::Evt21Legacy,
        StreamFormat::Evt3,
    ][usize::from(choice & 3)];
    let (first, second) = words.split_at(words.len().min(usize::from(choice >> 2) * 37));
    let (mut decoder, mut scanner) = (Decoder::new(format), Scanner::new(format));
    decoder.push(first, &mut NullSink);
    let _ = scanner.push(first);
    assert_eq!(
        decoder.stats(),
        scanner.stats(),
        "decoder and scanner count alike"
    );
    let origin_us = decoder.last_us().unwrap_or_default();
    decoder.restart(origin_us);
    scanner.restart(origin_us);
    decoder.push(second, &mut NullSink);
    let _ = scanner.push(second);
    assert_eq!(
        decoder.stats(),
        scanner.stats(),
        "decoder and scanner count alike"
    );
}

/// The first four bytes claim a length; the others are unfolded to it.
pub fn folded(bytes: &[u8]) {
    let Some((claim, stored)) = bytes.split_first_chunk::<4>() else {
        return;
    };
    if let Ok(raw) = codec::unfold(stored, u32::from_le_bytes(*claim) as usize) {
        assert_eq!(raw.len(), u32::from_le_bytes(*claim) as usize);
    }
    if let Some(refolded) = codec::fold(stored) {
        assert_eq!(
            codec::unfold(&refolded, stored.len()).as_deref(),
            Ok(stored)
        );
    }
}
