"""Two rays in a plane.

Method A: complex numbers in mpmath; the ranges follow from cross products of unit directions.
Method B: exact fractions; Cramer's rule on the lines through the cameras, with directions that are not normalised.
"""

from fractions import Fraction

from mpmath import mp, mpc, mpf

import rational
from certify import Problem, exact, relative_condition

NAME = "triangulation"
ABOUT = (
    "Intersection of two viewing rays. A camera at (x, y) looks at (aim_x, aim_y); a positive angle turns its ray clockwise. "
    "Either the angles are given, degrees, or the columns u, px, of a lens with angle = s h exp(-w |s|) + skew, s = (u - 320) / 320."
)
PAPER = [
    [44.25, -31.98, 10.0, 2.0, -1.92, 60.0, -0.17],
    [49.71, 39.81, 10.0, 2.0, -1.47, 60.0, 0.074],
]
KEYS = ["x", "y", "aim_x", "aim_y", "skew_deg", "half_fov_deg", "w"]


def camera(x, y, aim_x, aim_y):
    return [x, y, aim_x, aim_y, 0.0, 60.0, 0.0]


def angle_mp(camera, reading, columns):
    skew, half, w = camera[4:]
    if not columns:
        return mp.radians(reading)
    s = (mpf(reading) - 320) / 320
    return mp.radians(s * half * mp.exp(-w * abs(s)) + skew)


def rays_mp(values, columns):
    """x, y, ranges and sine."""
    cameras = [values[:7], values[7:14]]
    p = [mpc(c[0], c[1]) for c in cameras]
    d = []
    for c, reading in zip(cameras, values[14:]):
        axis = mpc(c[2], c[3]) - mpc(c[0], c[1])
        d.append(axis / abs(axis) * mp.expj(-angle_mp(c, reading, columns)))
    cross = lambda a, b: (mp.conj(a) * b).imag
    w, sine = p[1] - p[0], cross(d[0], d[1])
    ranges = [cross(w, d[1]) / sine, cross(w, d[0]) / sine]
    at = p[0] + ranges[0] * d[0]
    return [at.real, at.imag, *ranges, sine]


def rays_fractions(values, columns):
    values = [exact(v) for v in values]
    cameras = [values[:7], values[7:14]]
    lines, directions = [], []
    for c, reading in zip(cameras, values[14:]):
        angle = reading
        if columns:
            s = (reading - 320) / 320
            angle = s * c[5] * rational.exp(-c[6] * abs(s)) + c[4]
        sin, cos = rational.sin_cos(rational.radians(angle))
        ax, ay = c[2] - c[0], c[3] - c[1]
        dx, dy = ax * cos + ay * sin, ay * cos - ax * sin
        directions.append((dx, dy))
        lines.append((dy, -dx, dy * c[0] - dx * c[1]))
    (a1, b1, c1), (a2, b2, c2) = lines
    determinant = a1 * b2 - a2 * b1
    x, y = (c1 * b2 - c2 * b1) / determinant, (a1 * c2 - a2 * c1) / determinant
    lengths = [rational.sqrt(dx * dx + dy * dy) for dx, dy in directions]
    ranges = [
        ((x - c[0]) * d[0] + (y - c[1]) * d[1]) / length
        for c, d, length in zip(cameras, directions, lengths)
    ]
    (dx1, dy1), (dx2, dy2) = directions
    return [x, y, *ranges, (dx1 * dy2 - dy1 * dx2) / (lengths[0] * lengths[1])]


def rays(name, level, about, cameras, readings, outcome="solved", columns=False):
    inputs = {f"camera_{k + 1}": dict(zip(KEYS, c)) for k, c in enumerate(cameras)}
    inputs["columns_px" if columns else "angles_deg"] = readings
    problem = Problem(name, level, about, inputs, outcome)
    if outcome in ("missing", "parallel"):
        return problem
    values = [*cameras[0], *cameras[1], *readings]
    one, two = rays_mp([mpf(v) for v in values], columns), rays_fractions(values, columns)
    conditions = relative_condition(lambda v: rays_mp(v, columns), [mpf(v) for v in values])
    quantities = [("x", "mm"), ("y", "mm"), ("range_1", "mm"), ("range_2", "mm"), ("sine", "1")]
    for (quantity, unit), a, b, condition in zip(quantities, one, two, conditions):
        problem.answer(quantity, unit, a, b, condition)
    return problem


def column_mp(c, at):
    """Column of a point: the inverse of the lens by Lambert's W function."""
    x, y, aim_x, aim_y, skew, half, w = c
    axis, to = mpc(aim_x - x, aim_y - y), mpc(at[0] - x, at[1] - y)
    t = (-mp.degrees(mp.arg(to / axis)) - skew) / half
    s = t if w == 0 else -mp.lambertw(-w * abs(t)).real / w * mp.sign(t)
    return 320 + 320 * s


def column_fractions(c, at):
    """The same by Newton's method on the lens."""
    x, y, aim_x, aim_y, skew, half, w = [exact(v) for v in c]
    ax, ay, bx, by = aim_x - x, aim_y - y, exact(at[0]) - x, exact(at[1]) - y
    # The points are in front: the angle is below 90 degrees.
    angle = rational.atan((ay * bx - ax * by) / (ax * bx + ay * by)) * 180 / rational.PI
    t = (angle - skew) / half
    s = t
    for _ in range(100):
        falloff = rational.exp(-w * abs(s))
        step = (s * falloff - t) / (falloff * (1 - w * abs(s)))
        s = rational.near(s - step)
        if abs(step) < Fraction(1, 1 << 250):
            break
    return 320 + 320 * s


def column(name, level, about, c, at):
    problem = Problem(name, level, about, {"camera": dict(zip(KEYS, c)), "point_mm": at})
    values = [mpf(v) for v in [*c, *at]]
    condition = relative_condition(lambda v: [column_mp(v[:7], v[7:])], values)[0]
    return problem.answer("column", "px", column_mp(values[:7], values[7:]), column_fractions(c, at), condition)


def scaled(cameras, factor):
    return [[v * factor for v in c[:4]] + c[4:] for c in cameras]


def problems():
    level = camera(0.0, 0.0, 10.0, 0.0)
    square = camera(10.0, -20.0, 10.0, 0.0)
    beside = camera(0.0, 8.0, 10.0, 8.0)
    below = camera(0.0, -20.0, 0.0, 0.0)
    facing = [camera(0.0, 0.0, 10.0, 0.0), camera(40.0, 0.0, 10.0, 0.0)]
    unit = 2.0**-20
    return [
        rays("paper", "easy", "The published rig, columns near the middle", PAPER, [362.0, 301.5], columns=True),
        rays("paper-edges", "easy", "The published rig, columns near the edges", PAPER, [470.25, 186.125], columns=True),
        rays("right-angle", "easy", "Rays at about a right angle", [level, square], [-12.5, 7.25]),
        rays("near-fold", "average", "A lens that nearly folds at the edge: W = 0.999", [PAPER[0][:6] + [0.999], PAPER[1]], [639.5, 301.5], columns=True),
        rays("parallel-1e-3", "average", "Rays 1e-3 degrees apart", [level, beside], [-12.5, -12.499]),
        rays("parallel-1e-5", "hard", "Rays 1e-5 degrees apart", [level, beside], [-12.5, -12.49999]),
        rays("parallel-1e-7", "hard", "Rays 1.2e-7 degrees apart, just above the limit", [level, beside], [-12.5, -12.49999988]),
        rays("parallel-below", "hard", "Rays 5e-8 degrees apart: below the sine of 1e-9 that counts as parallel", [level, beside], [-12.5, -12.49999995], "parallel"),
        rays("parallel", "hard", "Exactly parallel rays", [level, beside], [-12.5, -12.5], "parallel"),
        rays("opposite", "average", "Cameras that face each other, contact 1e-5 mm off their baseline", facing, [-3.125e-5, 6.25e-5]),
        rays("behind", "easy", "The lines meet behind camera 1", [level, beside], [12.5, -40.0], "behind"),
        rays("behind-barely", "hard", "The lines meet 1e-9 mm behind camera 1", [level, below], [30.0, -3e-9], "behind"),
        rays("at-camera", "average", "The ray of camera 2 passes through camera 1", [level, below], [-30.0, 0.0]),
        rays("beside-camera", "average", "Contact 0.1 um from camera 1", [level, below], [-30.0, 2.5e-4]),
        rays("far-10-km", "hard", "Contact at about 10 km, cameras 8 mm apart", [level, beside], [-12.5, -12.499955]),
        rays("small-rig", "average", "The published rig shrunk to 0.1 um: exact factor 2^-20", scaled(PAPER, unit), [362.0, 301.5], columns=True),
        rays("large-rig", "average", "The published rig enlarged to 10 km: exact factor 2^18", scaled(PAPER, 2.0**18), [362.0, 301.5], columns=True),
        rays("missing", "easy", "A camera that sees nothing", PAPER, [362.0, None], "missing", columns=True),
        column("column-middle", "easy", "Column of a point near the axis", PAPER[0], [11.5, -3.25]),
        column("column-edge", "average", "Column of a point near the edge of a strongly distorted lens", PAPER[1][:6] + [0.75], [30.0, -6.0]),
        column("column-near-fold", "hard", "Column of a point about 4e-7 degrees below the fold", PAPER[1][:4] + [0.0, 60.0, 1.0], near_fold()),
    ]


def near_fold():
    """A point that the lens with W = 1 shows just inside the edge of the sensor."""
    c = [mpf(v) for v in PAPER[1][:4]]
    axis = mpc(c[2] - c[0], c[3] - c[1])
    s = mpf("0.999")
    at = mpc(c[0], c[1]) + axis * mp.expj(-mp.radians(60 * s * mp.exp(-s)))
    return [float(mp.nint(at.real * 4096) / 4096), float(mp.nint(at.imag * 4096) / 4096)]
