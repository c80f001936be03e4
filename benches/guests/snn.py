"""Locates presses by a network of spiking neurons: `skinrig challenge run SESSION --events -- python3 snn.py WEIGHTS.npz`."""

import functools
import sys

import numpy as np

import adapted
import networks
import press

if len(sys.argv) != 2:
    sys.exit("expected the file of weights that train.py wrote: snn.py WEIGHTS.npz")
weights = dict(np.load(sys.argv[1]))
adapted.run("snn", functools.partial(networks.snn, weights), press.course)
