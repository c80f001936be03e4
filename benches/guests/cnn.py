"""Locates presses by a convolutional network on event images: `skinrig challenge run SESSION --events -- python3 cnn.py WEIGHTS.npz`."""

import functools
import sys

import numpy as np

import adapted
import networks
import press

if len(sys.argv) != 2:
    sys.exit("expected the file of weights that train.py wrote: cnn.py WEIGHTS.npz")
weights = dict(np.load(sys.argv[1]))
adapted.run("cnn", functools.partial(networks.cnn, weights), press.picture)
