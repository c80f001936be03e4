"""Camera geometries fitted to presses at known positions.

The answer minimises the sum over presses of e^2 / (1 + (e / c)^2), c = 1 mm, with e the distance from the crossing of the two
rays to the true position.

Method A: derivatives by implicit differentiation of the crossing; the gradient is driven to zero by a fixed approximate Hessian.
Method B: crossing by Cramer's rule, derivatives by central differences with 70 digits, Broyden's method.
"""

import cmath
import math

from mpmath import matrix, mp, mpf

from certify import Problem, number

NAME = "calibration"
ABOUT = (
    "Least squares over presses: minimise sum e^2 / (1 + (e / c)^2), c = bound_mm, e = distance from the crossing of the rays of "
    "columns u1 and u2, px, to the position x, y, mm. Cameras look at aim, with the lens angle = s h scale exp(-w |s|) + skew, "
    "s = (u - 320) / 320; a positive angle turns the ray clockwise. The first `parameters` of [x1, y1, x2, y2, skew1, skew2, w1, "
    "w2, scale1, scale2] are free, the others have the values of any start. Presses are [u1, u2, x, y]."
)
NAMES = ["x1", "y1", "x2", "y2", "skew1", "skew2", "w1", "w2", "scale1", "scale2"]
UNITS = ["mm"] * 4 + ["deg"] * 2 + ["1"] * 4
AIM = (10.0, 2.0)
HALF = 60.0
BOUND = 1.0
PLANTED = [43.0, -33.0, 47.5, 38.0, -1.25, 0.5, -0.125, 0.0625, 1.0, 1.0]
# Distances of the starts from the planted parameters.
STARTS = {
    "easy": [1.0, -1.0, 0.5, 1.0, 0.25, -0.25, 0.02, 0.01, 0.0, 0.0],
    "average": [6.0, 5.0, -7.0, 4.0, -3.0, 3.5, 0.2, -0.2, 0.0, 0.0],
    "hard": [-24.0, 21.0, 18.0, -26.0, 14.0, -12.0, -0.5, 0.5, 0.0, 0.0],
}


class Floats:
    """The functions that both kinds of numbers have."""

    sin, cos, exp, sqrt, atan2 = math.sin, math.cos, math.exp, math.sqrt, math.atan2
    degree = math.pi / 180

    @staticmethod
    def of(x):
        return float(x)


class Precise:
    sin, cos, exp, sqrt, atan2 = (staticmethod(f) for f in (mp.sin, mp.cos, mp.exp, mp.sqrt, mp.atan2))

    @property
    def degree(self):
        return mp.pi / 180

    @staticmethod
    def of(x):
        return mpf(x)


def terms(m, p, press):
    """Error vector of a press and its derivatives, from the two rays and how they move."""
    u, truth = press[:2], press[2:]
    rays = []
    for k in range(2):
        x, y, skew, w, scale = p[2 * k], p[2 * k + 1], p[4 + k], p[6 + k], p[8 + k]
        ax, ay = AIM[0] - x, AIM[1] - y
        square = ax * ax + ay * ay
        length = m.sqrt(square)
        s = (m.of(u[k]) - 320) / 320
        falloff = m.exp(-w * abs(s))
        theta = (s * HALF * scale * falloff + skew) * m.degree
        sin, cos = m.sin(theta), m.cos(theta)
        d = ((ax * cos + ay * sin) / length, (ay * cos - ax * sin) / length)
        # Derivatives of the counter-clockwise angle of the ray by x, y, skew, w and scale.
        turn = [ay / square, -ax / square, -m.degree]
        turn.append(abs(s) * s * HALF * scale * falloff * m.degree)
        turn.append(-s * HALF * falloff * m.degree)
        rays.append(((x, y), d, turn))
    (p1, d1, _), (p2, d2, _) = rays
    sine = d1[0] * d2[1] - d1[1] * d2[0]
    w = (p2[0] - p1[0], p2[1] - p1[1])
    r = [(w[0] * d2[1] - w[1] * d2[0]) / sine, (w[0] * d1[1] - w[1] * d1[0]) / sine]
    at = (p1[0] + r[0] * d1[0], p1[1] + r[0] * d1[1])
    e = [at[0] - m.of(truth[0]), at[1] - m.of(truth[1])]
    slopes = [None] * 10
    for k, (_, d, turn) in enumerate(rays):
        # n_k . dX = n_k . dp_k + r_k dphi_k, and X moves along the other ray.
        other = rays[1 - k][1]
        along = (1 if k == 0 else -1) / sine
        moved = [-d[1] + r[k] * turn[0], d[0] + r[k] * turn[1]] + [r[k] * t for t in turn[2:]]
        for i, b in zip((2 * k, 2 * k + 1, 4 + k, 6 + k, 8 + k), moved):
            slopes[i] = (along * b * other[0], along * b * other[1])
    return e, slopes


def gradient(m, p, presses, count):
    """Half the gradient of the sum."""
    total = [m.of(0)] * count
    for press in presses:
        e, slopes = terms(m, p, press)
        share = 1 / (1 + (e[0] * e[0] + e[1] * e[1]) / (BOUND * BOUND)) ** 2
        for i in range(count):
            total[i] += share * (e[0] * slopes[i][0] + e[1] * slopes[i][1])
    return total


def solved_floats(columns, side):
    """Solution of a small system in floats, with pivots."""
    n = len(side)
    rows = [list(columns[i]) + [side[i]] for i in range(n)]
    for i in range(n):
        best = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[best] = rows[best], rows[i]
        for r in range(i + 1, n):
            factor = rows[r][i] / rows[i][i]
            rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][k] * x[k] for k in range(i + 1, n))) / rows[i][i]
    return x


def hessian(p, presses, count):
    """In floats, by central differences of the gradient."""
    columns = []
    for i in range(count):
        up, down = list(p), list(p)
        up[i] += 1e-5
        down[i] -= 1e-5
        pairs = zip(gradient(Floats, up, presses, count), gradient(Floats, down, presses, count))
        columns.append([(a - b) / 2e-5 for a, b in pairs])
    return columns


def method_a(presses, count):
    """Parameters, and the Hessian there."""
    p = [float(v) for v in PLANTED]
    for _ in range(8):
        step = solved_floats(hessian(p, presses, count), gradient(Floats, p, presses, count))
        p = [v - s for v, s in zip(p, step + [0.0] * 10)]
    matrix_ = hessian(p, presses, count)
    m, p = Precise(), [mpf(v) for v in p]
    for _ in range(40):
        slope = gradient(m, p, presses, count)
        size = max(abs(g) for g in slope)
        if size < mpf(10) ** -50:
            break
        step = solved_floats(matrix_, [float(g / size) for g in slope])
        for i in range(count):
            p[i] -= mpf(step[i]) * size
    return p, matrix_


def normal(m, p, camera, u):
    """The line a x + b y = c of a ray."""
    x, y = p[2 * camera : 2 * camera + 2]
    skew, w, scale = p[4 + camera], p[6 + camera], p[8 + camera]
    s = m.of(u) / 320 - 1
    axis = m.atan2(AIM[1] - y, AIM[0] - x)
    phi = axis - (HALF * scale * s / m.exp(w * abs(s)) + skew) * m.degree
    a, b = -m.sin(phi), m.cos(phi)
    return a, b, a * x + b * y


def normals(m, p, presses):
    return [[normal(m, p, k, press[k]) for press in presses] for k in range(2)]


def cost(m, lines, presses):
    """The sum, by Cramer's rule."""
    total = m.of(0)
    for (a1, b1, c1), (a2, b2, c2), (_, _, truth_x, truth_y) in zip(*lines, presses):
        determinant = a1 * b2 - a2 * b1
        x, y = (c1 * b2 - c2 * b1) / determinant, (a1 * c2 - a2 * c1) / determinant
        square = (x - m.of(truth_x)) ** 2 + (y - m.of(truth_y)) ** 2
        total += square / (1 + square / (BOUND * BOUND))
    return total


def differences(m, p, presses, count, h):
    """The gradient of the sum by central differences."""
    lines, found = normals(m, p, presses), []
    for i in range(count):
        camera = i // 2 if i < 4 else i % 2
        sides = []
        for sign in (1, -1):
            moved = list(p)
            moved[i] += sign * h
            changed = list(lines)
            changed[camera] = [normal(m, moved, camera, press[camera]) for press in presses]
            sides.append(cost(m, changed, presses))
        found.append((sides[0] - sides[1]) / (2 * h))
    return found


def method_b(presses, count):
    """Parameters by Broyden's method on central differences of the sum."""
    p = [float(v) for v in PLANTED]
    for _ in range(4):
        columns = []
        slope = differences(Floats, p, presses, count, 1e-5)
        for i in range(count):
            sides = []
            for sign in (1, -1):
                moved = list(p)
                moved[i] += sign * 1e-4
                sides.append(differences(Floats, moved, presses, count, 1e-5))
            columns.append([(a - b) / 2e-4 for a, b in zip(*sides)])
        columns = [[0.5 * (columns[i][j] + columns[j][i]) for j in range(count)] for i in range(count)]
        step = solved_floats(columns, slope)
        p = [v - s for v, s in zip(p, step + [0.0] * 10)]
    with mp.workdps(70):
        m, h = Precise(), mpf(10) ** -21
        inverse = matrix(columns) ** -1
        p = [mpf(v) for v in p]
        g = matrix(differences(m, p, presses, count, h))
        for _ in range(60):
            step = -(inverse * g)
            p = [v + step[i] if i < count else v for i, v in enumerate(p)]
            if max(abs(v) for v in step) < mpf(10) ** -38:
                return p
            new = matrix(differences(m, p, presses, count, h))
            change = inverse * (new - g)
            factor = (step.T * change)[0]
            inverse += (step - change) * (step.T * inverse) / factor
            g = new
    raise ArithmeticError("Broyden's method does not converge")


def rmse(p, presses):
    """Root mean square of the errors, by both crossings."""
    m = Precise()
    squares = [e[0] ** 2 + e[1] ** 2 for e, _ in (terms(m, p, press) for press in presses)]
    return mp.sqrt(mp.fsum(squares) / len(presses))


def rmse_of_cost(p, presses):
    m, total = Precise(), mpf(0)
    for press in presses:
        part = cost(m, normals(m, p, [press]), [press])
        total += part / (1 - part / mpf(BOUND) ** 2)
    return mp.sqrt(total / len(presses))


def conditions(p, presses, count, curvature):
    """Componentwise condition numbers of the parameters and of the rmse by the columns and positions."""
    p = [float(v) for v in p]
    base = gradient(Floats, p, presses, count)
    totals, of_rmse = [0.0] * count, 0.0
    level = float(rmse([mpf(v) for v in p], presses))
    for i, press in enumerate(presses):
        own, (e, _) = gradient(Floats, p, [press], count), terms(Floats, p, press)
        for j, value in enumerate(press):
            step = 1e-6 * max(abs(value), 1.0)
            moved = list(press)
            moved[j] += step
            changed = gradient(Floats, p, [moved], count)
            moves = solved_floats(curvature, [(a - b) / step for a, b in zip(changed, own)])
            totals = [t + abs(d * value) for t, d in zip(totals, moves)]
            f, _ = terms(Floats, p, moved)
            change = sum(a * a - b * b for a, b in zip(f, e)) / step / (2 * len(presses) * level)
            of_rmse += abs(change * value)
    return [t / abs(v) for t, v in zip(totals, p)], of_rmse / level


def seen(at, camera):
    """Column of a position, in half pixels."""
    x, y = PLANTED[2 * camera : 2 * camera + 2]
    turn = -cmath.phase(complex(at[0] - x, at[1] - y) / complex(AIM[0] - x, AIM[1] - y))
    target = math.degrees(turn) - PLANTED[4 + camera]
    low, high, w = -1.0, 1.0, PLANTED[6 + camera]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle * HALF * math.exp(-w * abs(middle)) < target else (low, middle)
    return round(2 * (320 + 320 * low)) / 2


def presses_at(places):
    return [[seen(at, 0), seen(at, 1), float(at[0]), float(at[1])] for at in places]


def starts(count):
    shift = lambda level: [v + d if i < count else v for i, (v, d) in enumerate(zip(PLANTED, STARTS[level]))]
    return {level: shift(level) for level in STARTS}


def fit(name, level, about, places, count):
    presses = presses_at(places)
    inputs = {"parameters": count, "bound_mm": BOUND, "aim_mm": list(AIM), "half_fov_deg": HALF}
    inputs |= {"starts": starts(count), "presses": presses}
    problem = Problem(name, level, about, inputs)
    one, curvature = method_a(presses, count)
    two = method_b(presses, count)
    of_parameters, of_rmse = conditions(one, presses, count, curvature)
    for i in range(count):
        problem.answer(NAMES[i], UNITS[i], one[i], two[i], of_parameters[i])
    return problem.answer("rmse", "mm", rmse(one, presses), rmse_of_cost(two, presses), of_rmse)


def refused(name, about, places, count, outcome):
    inputs = {"parameters": count, "bound_mm": BOUND, "aim_mm": list(AIM), "half_fov_deg": HALF}
    return Problem(name, "hard", about, inputs | {"starts": starts(count), "presses": presses_at(places)}, outcome)


def grid(columns, rows, x, y, step):
    return [(x + step * i, y + step * j) for i in range(columns) for j in range(rows)]


def line(start, to, n):
    return [tuple(a + (b - a) * i / (n - 1) for a, b in zip(start, to)) for i in range(n)]


def problems():
    camera = (PLANTED[2], PLANTED[3])
    # Through camera 2, and in front of it.
    through = [(camera[0] - 6.0 * k, camera[1] - 5.0 * k) for k in range(2, 11)]
    return [
        fit("positions", "easy", "Camera positions from nine presses", grid(3, 3, -10.0, -18.0, 18.0), 4),
        fit("skews", "average", "Positions and skews from twelve presses", grid(4, 3, -14.0, -18.0, 13.0), 6),
        fit("full", "average", "Positions, skews and distortions from twelve presses", grid(3, 4, -14.0, -22.0, 14.0), 8),
        fit("scale", "hard", "All ten parameters from twelve presses", grid(4, 3, -14.0, -22.0, 14.0), 10),
        fit("line", "hard", "Eight parameters from ten presses on one line", line((-5.0, -20.0), (-5.0, 25.0), 10), 8),
        fit("patch", "hard", "Four parameters from a patch of 2 mm", grid(3, 3, 8.0, 1.0, 1.0), 4),
        refused("through-camera", "A line through camera 2, which sees one column: 6 of 8 parameters", through, 8, "rank 6"),
        refused("one-place", "Nine presses at one position", [(8.0, 2.0)] * 9, 4, "rank 2"),
        refused("too-few", "One press for four parameters", [(8.0, 2.0)], 4, "too few"),
    ]
