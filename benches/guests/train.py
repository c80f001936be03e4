"""Trains both networks on simulated skins that differ, and writes their weights: `python3 train.py --skins 32 --out weights`.

Needs the packages of `requirements.txt` and skinrig's wheel.
"""

import argparse
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import skinrig

import networks
import press

#: Share of the events that a press keeps in training, at least: skins also send fewer.
LEAST_KEPT = 0.3
BATCH = 64


def skin(rng, seed, folder, protocol):
    """A session of one simulated skin, whose thickness, cloudiness, creep and grid of 64 locations are drawn."""
    origin = [f"{-26 + rng.uniform(0, 5):.2f} mm", f"{-32 + rng.uniform(0, 5):.2f} mm"]
    changed = {
        "path.meander.columns": 8,
        "path.meander.rows": 8,
        "path.meander.origin": origin,
        "path.meander.pitch": f"{rng.uniform(8.0, 9.0):.2f} mm",
        "repetitions.count": 2,
        "evaluation.score": [2],
        "scene.skin.thickness": f"{rng.uniform(3, 5):.2f} mm",
        "scene.skin.attenuation_length": f"{rng.uniform(50, 150):.0f} mm",
        "scene.skin.creep": f"{rng.uniform(0, 60):.0f} %",
        "scene.skin.creep_time": f"{rng.uniform(1, 4):.1f} s",
    }
    return skinrig.Session(skinrig.simulate(protocol, folder, changed, seed=seed))


def presses(session):
    """Events of both cameras from the contact on, and the position in mm, press by press."""
    for row in session.presses.query("role != 'sync' and verdict == 'valid'").itertuples():
        views = []
        for camera, contact_us in ((1, row.camera1_contact_us), (2, row.camera2_contact_us)):
            events = session.events(row.press, camera, margin_ms=500)
            views.append((events["t_us"] - contact_us, events["x_px"], events["y_px"], events["on"]))
        yield views, (row.measured_x_mm, row.measured_y_mm)


def thinned(rng, view, kept):
    """This share of a camera's events."""
    stays = rng.random(len(view[0])) < kept
    return [column[stays] for column in view]


def recorded(skins, seed, protocol, folder):
    """Pictures, courses and positions of the presses of so many skins; of each press some share of its events."""
    rng = np.random.default_rng(seed)
    pictures, courses, positions = [], [], []
    for number in range(skins):
        session = skin(rng, 1_000 * seed + number, folder, protocol)
        for views, position in presses(session):
            kept = rng.uniform(LEAST_KEPT, 1)
            views = [thinned(rng, view, kept) for view in views]
            pictures.append([press.picture(*v) for v in views])
            courses.append([press.course(*v) for v in views])
            positions.append(position)
        print(f"skin {number + 1} of {skins}: {len(positions)} presses", flush=True)
    return np.array(pictures), np.array(courses), np.array(positions, dtype=np.float32)


def drawn(rng, shapes):
    """Weights of these shapes, scaled by what each sums over; those of one dimension are 0."""
    def one(shape):
        return np.zeros(shape) if len(shape) == 1 else rng.normal(size=shape) / np.sqrt(np.prod(shape) / shape[_outputs(shape)])

    return {name: one(shape).astype(np.float32) for name, shape in shapes.items()}


def _outputs(shape):
    """Axis of the outputs: the first of a kernel, the last of a matrix."""
    return 0 if len(shape) == 4 else 1


CNN = {
    "kernel1": (8, 4, 3, 5), "bias1": (8,),
    "kernel2": (16, 8, 3, 5), "bias2": (16,),
    "hidden": (press.CAMERAS * 16 * press.COLUMNS // 4, 48), "hidden_bias": (48,),
    "out": (48, 2), "out_bias": (2,),
}
SNN = {
    "in": (2 * press.COLUMNS, 48), "in_bias": (48,),
    "out": (press.CAMERAS * 48, 2), "out_bias": (2,),
}


def cnn(w, pictures):
    """`networks.cnn` for gradients, in units of `SCALE_MM`."""
    x = pictures.reshape(-1, *pictures.shape[2:])
    for layer in ("1", "2"):
        x = jax.lax.conv_general_dilated(x, w["kernel" + layer], (1, 2), ((1, 1), (2, 2)))
        x = jax.nn.relu(x + w["bias" + layer][:, None, None])
    x = x.mean(axis=2).reshape(len(pictures), -1)
    return jnp.tanh(x @ w["hidden"] + w["hidden_bias"]) @ w["out"] + w["out_bias"]


@jax.custom_jvp
def spike(over):
    """1 above the threshold."""
    return (over > 0).astype(jnp.float32)


@spike.defjvp
def _surrogate(primals, tangents):
    """The gradient of a fast sigmoid stands for that of a step (Zenke and Ganguli 2018, SuperSpike)."""
    over, = primals
    return spike(over), tangents[0] / (1 + 5 * jnp.abs(over)) ** 2


def snn(w, courses):
    """`networks.snn` for gradients, in units of `SCALE_MM`."""
    n, cameras, steps, places = courses.shape
    drive = (courses.reshape(-1, places) @ w["in"] + w["in_bias"]).reshape(n * cameras, steps, -1)

    def step(state, now):
        potential, spikes = state
        potential = networks.KEPT * potential * (1 - spikes) + now
        spikes = spike(potential - 1)
        return (potential, spikes), spikes

    start = (jnp.zeros_like(drive[:, 0]),) * 2
    _, spikes = jax.lax.scan(step, start, drive.transpose(1, 0, 2))
    return spikes.mean(axis=0).reshape(n, -1) @ w["out"] + w["out_bias"]


def trained(network, weights, seen, positions, epochs, rng):
    """Adam (Kingma and Ba 2015) on the mean squared error, with a step that falls to 0 along a cosine."""
    def loss(w, x, y):
        return jnp.mean(jnp.sum((network(w, x) - y) ** 2, axis=1))

    @jax.jit
    def update(w, m, v, x, y, n, rate):
        value, g = jax.value_and_grad(loss)(w, x, y)
        m = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, m, g)
        v = jax.tree.map(lambda v, g: 0.999 * v + 0.001 * g * g, v, g)
        def moved(w, m, v):
            return w - rate * (m / (1 - 0.9**n)) / (jnp.sqrt(v / (1 - 0.999**n)) + 1e-8)
        return jax.tree.map(moved, w, m, v), m, v, value

    nothing = jax.tree.map(jnp.zeros_like, weights)
    m, v, n = nothing, nothing, 0
    steps = epochs * (len(positions) // BATCH)
    for epoch in range(epochs):
        order = rng.permutation(len(positions))
        values = []
        for at in range(0, len(order) - BATCH + 1, BATCH):
            batch, n = order[at:at + BATCH], n + 1
            rate = 2e-3 * 0.5 * (1 + np.cos(np.pi * n / steps))
            weights, m, v, value = update(weights, m, v, seen[batch], positions[batch] / networks.SCALE_MM, n, rate)
            values.append(value)
        if (epoch + 1) % 10 == 0:
            print(f"epoch {epoch + 1}: {networks.SCALE_MM * np.sqrt(np.mean(values)):.2f} mm", flush=True)
    return {name: np.asarray(w) for name, w in weights.items()}


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--skins", type=int, default=32)
    arguments.add_argument("--epochs", type=int, default=60)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--protocol", default="protocols/other-skin.yaml")
    arguments.add_argument("--sessions", default="sessions/training")
    arguments.add_argument("--out", type=Path, default=Path("weights"))
    chosen = arguments.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    pictures, courses, positions = recorded(chosen.skins, chosen.seed, chosen.protocol, chosen.sessions)
    print(f"simulated in {time.monotonic() - begun:.0f} s")
    for name, network, shapes, seen in (("cnn", cnn, CNN, pictures), ("snn", snn, SNN, courses)):
        rng = np.random.default_rng(chosen.seed)
        first = drawn(rng, shapes)
        np.savez(chosen.out / f"{name}-untrained.npz", **first)
        begun = time.monotonic()
        weights = trained(network, first, seen, positions, chosen.epochs, rng)
        np.savez(chosen.out / f"{name}.npz", **weights)
        print(f"{name}: {sum(w.size for w in weights.values())} weights, trained in {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
