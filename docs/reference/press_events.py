"""Reads the events of a press from a session file, with sqlite3 and numpy only.

The least arrival delay relates host and camera clock to some milliseconds; `skinrig analyze` fits them properly. Not handled: words split
between chunks, events before the first time word, a counter wrap (every 4 h 46 min), and the origin of a further leg (subtract it from
`first_us` before the shift, add it to `t`).
"""

import sqlite3, numpy as np

def press_events(path, press, camera, margin_us=50_000):
    db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    contact, release = db.execute("SELECT contact_ns / 1000, release_ns / 1000 FROM attempt WHERE press = ? ORDER BY number DESC", (press,)).fetchone()
    ahead, = db.execute("SELECT min(host_ns / 1000 - last_us) FROM chunk WHERE camera = ? AND abs(host_ns / 1000 - ?) < 60e6", (camera, contact)).fetchone()
    begin, end = contact - ahead - margin_us, release - ahead + margin_us      # on the camera's clock
    chunks = db.execute("SELECT stored, first_us FROM chunk WHERE camera = ? AND last_us >= ? AND first_us <= ? ORDER BY seq", (camera, begin, end)).fetchall()
    w = np.frombuffer(b"".join(stored for stored, _ in chunks), "<u4").astype(np.int64)
    kind, low = w >> 28, w & 0xFFFFFFF
    phase, shift, n = w >> 26 & 3, w >> 24 & 3, w & 0xFFFFFF                   # of a token
    steps = np.cumsum(np.where(kind == 0xB, phase + n >> shift, 0))            # by tokens, so far
    literal = np.maximum.accumulate(np.where(kind == 8, np.arange(len(w)), 0)) # the last time word
    high = low[literal] + steps - steps[literal]
    t = (chunks[0][1] >> 34 << 34) + (high << 6 | w >> 22 & 63)
    keep = (kind <= 1) & (kind[literal] == 8) & (t >= begin) & (t <= end)
    return t[keep], w[keep] >> 11 & 0x7FF, w[keep] & 0x7FF, kind[keep]         # t_us, x, y, polarity
