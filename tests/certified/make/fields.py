"""Positions where two Gaussian processes explain the columns of two cameras.

Method A: mpmath; Cholesky factors, Newton's method.
Method B: fractions; elimination without square roots, repeated substitution x = (u - field) / slope.
"""

from fractions import Fraction

from mpmath import matrix, mp, mpf

import rational
from certify import Problem, exact

NAME = "fields"
ABOUT = (
    "Camera k shows a press at (x, y) in column u_k = c + cx x + cy y + f_k(x, y), px, with f_k the posterior mean of a Gaussian "
    "process with zero mean and covariance amplitude^2 exp(-d^2 / (2 length^2)), given observations [x, y, residual, variance]. "
    "Find (x, y). `kernel_condition` is that of the covariance with the variances, in the 1-norm, of the worse camera."
)


def covariance_mp(camera, a, b):
    square = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2
    return mpf(camera["amplitude_px"]) ** 2 * mp.exp(-square / (2 * mpf(camera["length_mm"]) ** 2))


def learnt_mp(camera):
    """Matrix, Cholesky factor and weights."""
    points = [[mpf(v) for v in p] for p in camera["points"]]
    n = len(points)
    whole = matrix(n, n)
    for i in range(n):
        for j in range(n):
            whole[i, j] = covariance_mp(camera, points[i], points[j]) + (points[i][3] if i == j else 0)
    factor = mp.cholesky(whole)
    return points, whole, factor, solve(factor, matrix([p[2] for p in points]))


def solve(factor, side):
    n = len(side)
    x = side.copy()
    for i in range(n):
        x[i] = (x[i] - mp.fsum(factor[i, k] * x[k] for k in range(i))) / factor[i, i]
    for i in reversed(range(n)):
        x[i] = (x[i] - mp.fsum(factor[k, i] * x[k] for k in range(i + 1, n))) / factor[i, i]
    return x


def position_mp(cameras, columns):
    """Position, the learnt parts, and the slopes of the columns there."""
    learnt = [learnt_mp(c) for c in cameras]
    at = [mpf(columns[k] - c["column"][0]) / c["column"][k + 1] for k, c in enumerate(cameras)]
    for _ in range(40):
        off, slopes = [], []
        for camera, (points, _, _, alpha), column in zip(cameras, learnt, columns):
            c, cx, cy = (mpf(v) for v in camera["column"])
            near = [covariance_mp(camera, at, p) * a for p, a in zip(points, alpha)]
            square = mpf(camera["length_mm"]) ** 2
            off.append(mpf(column) - c - cx * at[0] - cy * at[1] - mp.fsum(near))
            dx = mp.fsum(v * (p[0] - at[0]) for v, p in zip(near, points)) / square
            dy = mp.fsum(v * (p[1] - at[1]) for v, p in zip(near, points)) / square
            slopes.append((cx + dx, cy + dy))
        (a, b), (c, d) = slopes
        det = a * d - b * c
        step = [(d * off[0] - b * off[1]) / det, (a * off[1] - c * off[0]) / det]
        at = [at[0] + step[0], at[1] + step[1]]
        if max(abs(s) for s in step) < mpf(10) ** -50:
            return at, learnt, [[d / det, -b / det], [-c / det, a / det]]
    raise ArithmeticError("Newton's method does not converge")


def weights_fractions(camera):
    """Solution of the symmetric system by elimination in exact fractions of rounded covariances."""
    points = [[exact(v) for v in p] for p in camera["points"]]
    n = len(points)
    rows = []
    for i in range(n):
        row = [covariance_fractions(camera, points[i], q) for q in points] + [points[i][2]]
        row[i] += points[i][3]
        rows.append(row)
    for i in range(n):
        for r in range(i + 1, n):
            factor = rows[r][i] / rows[i][i]
            if factor:
                rows[r] = [rational.near(v - factor * w) for v, w in zip(rows[r], rows[i])]
    alpha = [Fraction(0)] * n
    for i in reversed(range(n)):
        known = sum(rows[i][k] * alpha[k] for k in range(i + 1, n))
        alpha[i] = rational.near((rows[i][n] - known) / rows[i][i])
    return points, alpha


def covariance_fractions(camera, a, b):
    square = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2
    exponent = -square / (2 * exact(camera["length_mm"]) ** 2)
    return rational.near(exact(camera["amplitude_px"]) ** 2 * rational.exp(exponent))


def position_fractions(cameras, columns):
    learnt = [weights_fractions(c) for c in cameras]
    at = [Fraction(0), Fraction(0)]
    for _ in range(200):
        sides = []
        for camera, (points, alpha), column in zip(cameras, learnt, columns):
            field = sum(covariance_fractions(camera, at, p) * a for p, a in zip(points, alpha))
            sides.append(exact(column) - exact(camera["column"][0]) - field)
        (a, b), (c, d) = ([exact(v) for v in camera["column"][1:]] for camera in cameras)
        det = a * d - b * c
        new = [(d * sides[0] - b * sides[1]) / det, (a * sides[1] - c * sides[0]) / det]
        new = [rational.near(v) for v in new]
        step = max(abs(p - q) for p, q in zip(new, at))
        at = new
        if step < Fraction(1, 1 << 120):
            return at
    raise ArithmeticError("substitution does not converge")


def kernel_condition(whole):
    n = whole.rows
    inverse = whole**-1
    norm = lambda m: max(mp.fsum(abs(m[i, j]) for i in range(n)) for j in range(n))
    return norm(whole) * norm(inverse)


def conditions(cameras, columns, at, learnt, inverse):
    """Of x and y, for relative changes of columns, coefficients, covariances, variances and residuals."""
    sizes = []
    for camera, column, (points, whole, factor, alpha) in zip(cameras, columns, learnt):
        near = matrix([covariance_mp(camera, at, p) for p in points])
        v = solve(factor, near)
        n = len(points)
        size = mp.fsum(abs(near[i] * alpha[i]) + abs(v[i] * points[i][2]) for i in range(n))
        size += mp.fsum(abs(v[i] * whole[i, j] * alpha[j]) for i in range(n) for j in range(n))
        c, cx, cy = camera["column"]
        sizes.append(size + abs(column) + abs(c) + abs(cx * at[0]) + abs(cy * at[1]))
    return [mp.fsum(abs(inverse[i][k]) * sizes[k] for k in range(2)) / abs(at[i]) for i in range(2)]


def field(name, level, about, cameras, columns, outcome="solved"):
    inputs = {f"camera_{k + 1}": c for k, c in enumerate(cameras)}
    inputs["columns_px"] = columns
    problem = Problem(name, level, about, inputs, outcome)
    if outcome != "solved":
        return problem
    at, learnt, inverse = position_mp(cameras, columns)
    worse = max(kernel_condition(whole) for _, whole, _, _ in learnt)
    inputs["kernel_condition"] = float(mp.nstr(worse, 2))
    other, condition = position_fractions(cameras, columns), conditions(cameras, columns, at, learnt, inverse)
    for i, quantity in enumerate(("x", "y")):
        problem.answer(quantity, "mm", at[i], other[i], condition[i])
    return problem


def camera(column, amplitude, length, points):
    return {"column": column, "amplitude_px": amplitude, "length_mm": length, "points": points}


def smooth(place, k):
    """A smooth residual in multiples of 1/64 px."""
    x, y = place
    return round(64 * (2.0 + 0.05 * (x - k) - 0.002 * x * y + 0.003 * y * y)) / 64


def rough(i, k):
    return ((i * 37 + k * 11) % 23 - 11) / 64


def pair(places, amplitude, length, variance, residual):
    columns = [[320.0, 4.0, 0.5], [300.0, -0.25, 4.0]]
    return [
        camera(c, amplitude, length, [[x, y, residual(i, (x, y), k), variance] for i, (x, y) in enumerate(places)])
        for k, c in enumerate(columns)
    ]


def problems():
    grid = lambda n, m, step: [(step * i - 5.0, step * j - 4.0) for i in range(n) for j in range(m)]
    by_place = lambda i, place, k: smooth(place, k)
    by_row = lambda i, place, k: rough(i, k)
    twice = [(0.0, 0.0), (0.0, 0.0), (6.0, 2.0), (6.0, 2.0), (-3.0, 5.0)]
    close = [(0.5 * i - 1.0, 0.5 * j - 0.5) for i in range(4) for j in range(2)]
    row = [(0.25 * i, 1.0) for i in range(12)]
    sloped = lambda i, place, k: 1.0 + place[0] / 8 + k
    return [
        field("grid", "easy", "Nine places 10 mm apart", pair(grid(3, 3, 10.0), 3.0, 20.0, 0.01, by_place), [345.5, 328.25]),
        field("spaced", "easy", "Places much further apart than the length scale", pair(grid(3, 3, 40.0), 3.0, 5.0, 0.01, by_row), [352.0, 310.5]),
        field("flat", "average", "A length scale of 1 m", pair(grid(3, 3, 10.0), 3.0, 1000.0, 0.01, by_place), [345.5, 328.25]),
        field("repeated", "average", "Places that repeat, small variances", pair(twice, 3.0, 20.0, 1e-6, by_row), [330.0, 311.0]),
        field("close", "hard", "Eight places within 2 mm, length scale 20 mm, variances 1e-4", pair(close, 3.0, 20.0, 1e-4, by_place), [322.0, 303.5]),
        field("closer", "hard", "The same with variances 1e-8: nearly singular", pair(close, 3.0, 20.0, 1e-8, by_place), [322.0, 303.5]),
        field("rough", "hard", "Nearly singular, and the residuals do not fit the field", pair(close, 0.5, 4.0, 1e-8, by_row), [320.25, 300.5]),
        field("row", "hard", "Twelve places in a row, length scale 50 mm, variances 1e-8", pair(row, 3.0, 50.0, 1e-8, sloped), [326.0, 303.5]),
        field("row-nearly-singular", "hard", "The same with variances 1e-12", pair(row, 3.0, 50.0, 1e-12, sloped), [326.0, 303.5]),
        field("singular", "hard", "The same place twice without variance", pair(twice, 3.0, 20.0, 0.0, by_row), [330.0, 311.0], "singular"),
        field("singular-row", "hard", "Twelve places in a row, variances 1e-24: singular in doubles", pair(row, 3.0, 50.0, 1e-24, by_row), [330.0, 311.0], "singular"),
    ]
