"""Owns what a network sees of a press: the counts of its events by time, row, column and polarity."""

import numpy as np

CAMERAS = 2
COLUMNS, COLUMN_PX = 64, 10
ROWS, ROW_PX, FIRST_ROW = 12, 16, 176
STEPS, STEP_MS = 40, 12.5
EARLY_MS = 150.0


def _counts(places, shape):
    """Square roots of how often each place comes: their scatter is the same for weak and strong presses."""
    flat = np.ravel_multi_index(places, shape)
    return np.sqrt(np.bincount(flat, minlength=np.prod(shape)).reshape(shape)).astype(np.float32)


def picture(t_us, x_px, y_px, on):
    """Events of a camera as pictures of 12 by 64: OFF and ON, to 150 ms after the contact and from then on to 500 ms."""
    t_ms = np.asarray(t_us, dtype=float) / 1e3
    row = (np.asarray(y_px, dtype=int) - FIRST_ROW) // ROW_PX
    seen = (t_ms >= 0) & (t_ms < STEPS * STEP_MS) & (row >= 0) & (row < ROWS)
    part = 2 * (t_ms >= EARLY_MS) + np.asarray(on, dtype=int)
    column = np.asarray(x_px, dtype=int) // COLUMN_PX
    return _counts((part[seen], row[seen], column[seen]), (4, ROWS, COLUMNS))


def course(t_us, x_px, y_px, on):
    """Events of a camera as 40 steps of 12.5 ms from the contact on, each with its OFF and ON events by column: 40 by 128."""
    t_ms = np.asarray(t_us, dtype=float) / 1e3
    row = (np.asarray(y_px, dtype=int) - FIRST_ROW) // ROW_PX
    seen = (t_ms >= 0) & (t_ms < STEPS * STEP_MS) & (row >= 0) & (row < ROWS)
    step = (t_ms // STEP_MS).astype(int)
    place = np.asarray(x_px, dtype=int) // COLUMN_PX + COLUMNS * np.asarray(on, dtype=int)
    return _counts((step[seen], place[seen]), (STEPS, 2 * COLUMNS))
