"""Owns the two networks, in numpy: from what the cameras see of presses to features and a position."""

import numpy as np

#: Positions are learnt in units of this many mm.
SCALE_MM = 25.0
#: Share of its potential that a spiking neuron keeps from step to step.
KEPT = 0.8


def _convolved(x, kernel, bias):
    """Convolution of 3 by 5, every second column, then ReLU. `x`: presses, channels, rows, columns."""
    padded = np.pad(x, ((0, 0), (0, 0), (1, 1), (2, 2)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 5), axis=(2, 3))[:, :, :, ::2]
    n, channels, rows, columns = windows.shape[:4]
    flat = windows.transpose(0, 2, 3, 1, 4, 5).reshape(n * rows * columns, channels * 15)
    y = flat @ kernel.reshape(len(kernel), -1).T + bias
    return np.maximum(y, 0).reshape(n, rows, columns, -1).transpose(0, 3, 1, 2)


def cnn(weights, pictures):
    """Pictures (presses, cameras, 4, rows, columns) to 48 features and positions in mm."""
    n = len(pictures)
    x = pictures.reshape(-1, *pictures.shape[2:])
    x = _convolved(x, weights["kernel1"], weights["bias1"])
    x = _convolved(x, weights["kernel2"], weights["bias2"])
    x = x.mean(axis=2).reshape(n, -1)
    features = np.tanh(x @ weights["hidden"] + weights["hidden_bias"])
    return features, SCALE_MM * (features @ weights["out"] + weights["out_bias"])


def snn(weights, courses):
    """Courses (presses, cameras, steps, places) to spike counts of leaky integrate-and-fire neurons and positions in mm."""
    n, cameras, steps, places = courses.shape
    drive = courses.reshape(-1, places) @ weights["in"] + weights["in_bias"]
    drive = drive.reshape(n * cameras, steps, -1)
    potential = np.zeros_like(drive[:, 0])
    spikes = np.zeros_like(potential)
    count = np.zeros_like(potential)
    for step in range(steps):
        potential = KEPT * potential * (1 - spikes) + drive[:, step]
        spikes = (potential > 1).astype(np.float32)
        count += spikes
    features = (count / steps).reshape(n, -1)
    return features, SCALE_MM * (features @ weights["out"] + weights["out_bias"])
