"""Checks the history of finished sessions with the standard library alone: plan against journal against camera bytes.

    python3 tests/crash/history.py SESSION...

It shares no code with what writes sessions: it reads the tables with sqlite3, unfolds the chunks and reads the trigger trains out of
the cameras' bytes as docs/reference/session-file.md and crates/model/src/pulse.rs describe them. Prints what is wrong; ends with 1 when anything
is, else with 0. It expects a complete EVT2 session of a rig whose trigger line works, in which every press is valid in the end. A press
may be taken again because a process was gone, or because the rig or the operator cost an attempt; after a run that came to its end
only such presses are.
"""

import array
import bisect
import hashlib
import json
import sqlite3
import struct
import sys
import zlib
from collections import Counter

CONTACT, LOOPBACK = 2, (1 << 17) - 1
PASSING = {"data_lost", "no_data", "data_late", "storm", "late", "aside", "paused", "run_ended"}
KINDS = {"approach": 1, "contact": 2, "at_depth": 3, "retract": 4, "release": 5}


def unfolded(stored, codec):
    """The words as they came."""
    words = array.array("I")
    if codec == "none":
        return bytes(stored)
    last = None
    for (word,) in struct.iter_unpack("<I", stored):
        kind = word >> 28
        if kind == 0xB:
            phase, shift, n = word >> 26 & 3, word >> 24 & 3, word & 0xFFFFFF
            words.extend(0x80000000 | (last + (phase + 1 + k >> shift)) & 0xFFFFFFF for k in range(n))
            last = (last + (phase + n >> shift)) & 0xFFFFFFF
        else:
            if kind == 8:
                last = word & 0xFFFFFFF
            words.append(word)
    if sys.byteorder == "big":
        words.byteswap()
    return words.tobytes()


def edges(stored, base):
    """(time in us, rising) of each trigger edge, and the last time word."""
    found = []
    for (word,) in struct.iter_unpack("<I", stored):
        kind = word >> 28
        if kind == 8:
            base = word & 0xFFFFFFF
        elif kind == 0xB:
            base = base + ((word >> 26 & 3) + (word & 0xFFFFFF) >> (word >> 24 & 3)) & 0xFFFFFFF
        elif kind == 0xA and base is not None:
            found.append((base << 6 | word >> 22 & 63, word & 1))
    return found, base


def trains(found):
    """(kind, number) of each whole train among the edges of one camera in one leg."""
    pulses, up = [], None
    for t, rising in found:
        if rising:
            up = t
        elif up is not None:
            pulses.append((up, t - up))
            up = None
    out = []
    for i, (start, width) in enumerate(pulses):
        if abs(width - 300) > 40 or len(pulses) < i + 32:
            continue
        rest = pulses[i + 1 : i + 32]
        if any(abs(t - start - 400 * (k + 1)) > 40 for k, (t, _) in enumerate(rest)):
            continue
        bits = "".join("1" if w > 150 else "0" for _, w in rest)
        out.append((int(bits[:3], 2), int(bits[3:20], 2)))
    return out


def check(path):
    wrong = []
    db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    db.row_factory = sqlite3.Row

    def rows(sql, *values):
        return db.execute(sql, values).fetchall()

    def expect(what, wanted, found):
        if wanted != found:
            wrong.append(f"{what}: expected {wanted}, found {found}")

    plan = json.loads(rows("SELECT plan_json FROM session")[0][0])["presses"]
    presses = rows("SELECT * FROM press ORDER BY id")
    expect("presses", [(p["id"], p["role"]) for p in plan], [(p["id"], p["role"]) for p in presses])
    further = rows("SELECT * FROM leg ORDER BY number")
    origins = [0] + [leg["origin_ns"] for leg in further]
    expect("legs", list(range(2, len(further) + 2)), [leg["number"] for leg in further])

    def leg_of(t_ns):
        return bisect.bisect_right(origins, t_ns)

    # Every press that scores: exactly one valid attempt, the last; sync presses once in each leg at most.
    valid = {}
    for press in presses:
        attempts = rows("SELECT * FROM attempt WHERE press = ? ORDER BY number", press["id"])
        place = f"press {press['id']}"
        expect(f"{place}: numbers", list(range(1, len(attempts) + 1)), [a["number"] for a in attempts])
        expect(f"{place}: lineage", [None] + list(range(1, len(attempts))), [a["previous"] for a in attempts])
        expect(f"{place}: the last verdict", "valid", attempts[-1]["verdict"] if attempts else None)
        good = [a for a in attempts if a["verdict"] == "valid"]
        if press["role"] != "sync":
            expect(f"{place}: valid attempts", 1, len(good))
        for attempt in good:
            leg = leg_of(attempt["intent_ns"])
            if (press["id"], leg) in valid:
                wrong.append(f"{place}: two valid attempts in leg {leg}")
            valid[press["id"], leg] = attempt
            expect(f"{place}: leg of attempt {attempt['number']}", leg, attempt["leg"])
    def passes(attempt):
        """Whether it is invalid for nothing but what the rig or the operator did."""
        return attempt["verdict"] == "invalid" and set((attempt["faults"] or "none").split()) <= PASSING

    tried = rows("SELECT * FROM attempt WHERE intent_ns IS NOT NULL ORDER BY press, number")
    taken = Counter((leg_of(a["intent_ns"]), a["press"]) for a in tried)
    for (leg, press), n in taken.items():
        again = [a for a in tried if a["press"] == press and leg_of(a["intent_ns"]) == leg][1:]
        before = {a["number"]: a for a in tried if a["press"] == press}
        expect(f"press {press}: attempts in leg {leg}", 1 + sum(passes(before[a["previous"]]) for a in again), n)
    roles = {p["id"]: p["role"] for p in presses}
    for leg in further:
        if leg["previous_status"] != "completed":
            continue
        for press in {p for n, p in taken if n == leg["number"] and roles[p] != "sync"}:
            before = [a for a in tried if a["press"] == press and leg_of(a["intent_ns"]) < leg["number"]]
            if not before or not passes(before[-1]):
                wrong.append(f"press {press}: taken again in leg {leg['number']}, although the run before it had come to its end with it")

    told = Counter((leg_of(m["t_ns"]), KINDS[m["kind"]], m["press"]) for m in rows("SELECT * FROM mark"))
    totals = Counter()
    for camera in (1, 2):
        firsts = [0] + [leg[f"first_seq_{camera}"] for leg in further]
        chunks = rows("SELECT * FROM chunk WHERE camera = ? ORDER BY seq", camera)
        expect(f"camera {camera}: chunks", list(range(len(chunks))), [c["seq"] for c in chunks])
        by_leg, base, ends = {}, None, Counter()
        for chunk in chunks:
            place = f"camera {camera} chunk {chunk['seq']}"
            leg = bisect.bisect_right(firsts, chunk["seq"])
            raw = unfolded(chunk["stored"], chunk["codec"])
            expect(f"{place}: SHA-256", chunk["stored_sha256"], hashlib.sha256(chunk["stored"]).digest())
            expect(f"{place}: bytes", (chunk["raw_bytes"], chunk["raw_crc32"]), (len(raw), zlib.crc32(raw)))
            expect(f"{place}: lost", 0, chunk["lost_before"])
            expect(f"{place}: leg by its time", leg, leg_of(chunk["host_ns"]))
            if leg not in by_leg:
                base = None
            found, base = edges(chunk["stored"], base)
            by_leg.setdefault(leg, []).extend(found)
            ends[leg] = chunk["host_ns"]
            expect(f"{place}: edges", chunk["trigger_edges"], len(found))
            totals.update(chunks=1, raw_bytes=chunk["raw_bytes"], trigger_edges=len(found))
        seen = Counter((leg, *train) for leg, found in by_leg.items() for train in trains(found))
        for (press, leg), attempt in valid.items():
            place = f"camera {camera}, press {press}, leg {leg}"
            if attempt["clear_ns"] > ends[leg]:
                wrong.append(f"{place}: its bytes end before it was over")
            if taken[leg, press] > 1:
                # What the attempts before it told the cameras may be lost.
                expect(f"{place}: any contact", True, 1 <= seen[leg, CONTACT, press] <= told[leg, CONTACT, press])
                continue
            for kind in KINDS.values():
                expect(f"{place}: trains of kind {kind}", told[leg, kind, press], seen[leg, kind, press])
            expect(f"{place}: contacts", 1, seen[leg, CONTACT, press])
        for leg, kind, press in seen:
            # Nothing is in the bytes that the journal does not know; the box also sends trains by itself (kind 6).
            if kind != 6 and press != LOOPBACK and (leg, press) not in taken:
                wrong.append(f"camera {camera}, leg {leg}: a train of press {press}, which was not tried there")

    seal = rows("SELECT * FROM seal")
    expect("seals", 1, len(seal))
    if seal:
        expect("seal: scored presses", sum(p["role"] != "sync" for p in presses), seal[0]["valid"])
        for column, n in totals.items():
            expect(f"seal: {column}", n, seal[0][column])
    expect("end", ["completed"], [end["status"] for end in rows("SELECT status FROM run_end")])
    return wrong


def main():
    bad = 0
    for path in sys.argv[1:]:
        for problem in check(path):
            print(f"{path}: {problem}")
            bad = 1
    sys.exit(bad)


main()
