"""Quantiles, distributions, intervals and tests of few or equal values.

Method A: mpmath with incomplete beta and error functions.
Method B: fractions, integrals of densities by quadrature, closed forms.
"""

from fractions import Fraction

from mpmath import mp, mpf

import rational
from certify import Problem, exact, number, relative_condition

NAME = "quantiles"
ABOUT = (
    "`values` with `q`: quantile with linear interpolation between order statistics at q (n - 1). `normal` and `student`: quantile "
    "at p, or probability at most t with df degrees of freedom. `mean`, `rms`: 95 % interval of Student's t over locations with "
    "one value each (for the rms on the scale of its logarithm, to first order). `shared`, `independent`: two-sided p value of b - a, paired or after Welch. "
    "`by_place`: the same for the mean of all values of locations that have several. "
    "`share` of trues among locations (exact binomial limits at 0 and 1), `score`: Wilson's limits of a share p at Student's t with "
    "n - 1 degrees of freedom, for p (1 - p) / s^2 trials, s the standard error of p over n locations; n trials for 0 and 1."
)


def tail_integral(t, df):
    """P(T > t) for t >= 0, by quadrature of the density."""
    df, t = mpf(df), mpf(t)
    scale = mp.exp(mp.loggamma((df + 1) / 2) - mp.loggamma(df / 2)) / mp.sqrt(df * mp.pi)
    # x = sqrt(df) tan(phi) makes the range finite.
    density = lambda phi: mp.cos(phi) ** (df - 1)
    low = mp.atan(t / mp.sqrt(df))
    width = 1 / mp.sqrt(df + t * t)
    ends = [low]
    while ends[-1] + width < mp.pi / 2 and width < 1:
        ends.append(ends[-1] + width)
        width *= 2
    # A third more digits than both methods must agree on.
    with mp.workdps(40):
        return scale * mp.sqrt(df) * mp.quad(density, [*ends, mp.pi / 2])


def student_tail(t, df):
    """P(T > t) for t >= 0, by the incomplete beta function."""
    df, t = mpf(df), mpf(t)
    return mp.betainc(df / 2, mpf(1) / 2, 0, df / (df + t * t), regularized=True) / 2


def student_density(t, df):
    df = mpf(df)
    scale = mp.exp(mp.loggamma((df + 1) / 2) - mp.loggamma(df / 2)) / mp.sqrt(df * mp.pi)
    return scale * (1 + t * t / df) ** (-(df + 1) / 2)


def inverse(tail, density, p, start, steps):
    """The positive point beyond which the probability is p, by Newton's method on logarithms."""
    t = mpf(start)
    for _ in range(steps):
        found = tail(t)
        change = mp.log(found / p) * found / (density(t) * t)
        t *= mp.exp(change)
        if abs(change) < mpf(10) ** -32:
            break
    return t


def student_quantile(p, df, tail=student_tail, start=None, steps=40):
    p = mpf(p)
    upper = min(p, 1 - p)
    if start is None:
        start = min(mpf(5), mp.sqrt(df)) if df < 2 else mpf(1)
    found = inverse(lambda t: tail(t, df), lambda t: student_density(t, df), upper, start, steps)
    return found if p > mpf(1) / 2 else -found


def normal_density(z):
    return mp.exp(-z * z / 2) / mp.sqrt(2 * mp.pi)


def normal_tail(z):
    return mp.erfc(z / mp.sqrt(2)) / 2


def normal_tail_integral(z):
    width = 1 / (1 + z)
    ends = [mpf(0)] + [width * 2**k for k in range(12)]
    with mp.workdps(40):
        return normal_density(z) * mp.quad(lambda x: mp.exp(-z * x - x * x / 2), [*ends, mp.inf])


def quantile(name, level, about, values, q, outcome="solved"):
    problem = Problem(name, level, about, {"values": values, "q": q}, outcome)
    if outcome != "solved":
        return problem

    def fractions(v, q):
        position = q * (len(v) - 1)
        index = int(position)
        if index + 1 >= len(v):
            return v[-1]
        return v[index] + (position - index) * (v[index + 1] - v[index])

    one = fractions([exact(v) for v in values], exact(q))
    # The same as a sum of hat functions over all values.
    position = mpf(q) * (len(values) - 1)
    with mp.workdps(120):
        two = mp.fsum(mpf(v) * max(mpf(0), 1 - abs(position - i)) for i, v in enumerate(values))
    with mp.workdps(400):
        condition = relative_condition(
            lambda x: [fractions(x[:-1], x[-1] if x[-1] <= 1 else mpf(1))], [mpf(v) for v in [*values, q]]
        )[0]
    return problem.answer("quantile", "1", one, two, condition)


def normal(name, level, about, p):
    problem = Problem(name, level, about, {"distribution": "normal", "p": p})
    upper = min(mpf(p), 1 - mpf(p))
    start = mp.sqrt(max(mpf("0.01"), -2 * mp.log(2 * upper))) * mpf("0.9")
    if abs(mpf(p) - mpf(1) / 2) < mpf("0.1"):
        start = (mpf(1) / 2 - upper) * mp.sqrt(2 * mp.pi)
    one = inverse(normal_tail, normal_density, upper, start, 40)
    two = inverse(normal_tail_integral, normal_density, upper, mpf(float(one)), 2)
    sign = 1 if p > 0.5 else -1
    condition = mpf(p) / normal_density(one) / one
    return problem.answer("quantile", "1", sign * one, sign * two, condition)


def student(name, level, about, p, df, closed=None):
    problem = Problem(name, level, about, {"distribution": "student", "p": p, "df": df})
    one = student_quantile(p, df)
    two = closed(mpf(p)) if closed else student_quantile(p, df, tail_integral, abs(float(one)), 2)
    condition = mpf(p) / student_density(one, df) / abs(one) + 1
    return problem.answer("quantile", "1", one, two, condition)


def probability(name, level, about, t, df):
    problem = Problem(name, level, about, {"distribution": "student", "t": t, "df": df})
    below = lambda tail: tail(-t, df) if t < 0 else 1 - tail(t, df)
    one, two = below(student_tail), below(tail_integral)
    condition = abs(mpf(t)) * student_density(mpf(t), df) / one + 1
    return problem.answer("probability", "1", one, two, condition)


T_TWO = {1: lambda p: mp.tan(mp.pi * (p - mpf(1) / 2)), 2: lambda p: (2 * p - 1) / mp.sqrt(2 * p * (1 - p))}


def sum_of_exponential(x):
    """exp(x) from its series at x / 2^20, squared twenty times."""
    with mp.workdps(80):
        small, term, total = x / 2**20, mpf(1), mpf(1)
        for k in range(1, 30):
            term *= small / k
            total += term
        for _ in range(20):
            total *= total
        return total


def interval(name, level, about, kind, values):
    """Value and limits; A with mpmath, B with fractions and a closed form of Student's quantile where there is one."""
    problem = Problem(name, level, about, {kind: values})
    df = len(values) - 1
    p = mpf(0.975)
    t_one = student_quantile(p, df)
    t_two = T_TWO[df](p) if df in T_TWO else student_quantile(p, df, tail_integral, float(t_one), 2)

    def limits(v):
        squares = [x * x for x in v] if kind == "rms" else v
        mean = mp.fsum(squares) / len(v)
        error = mp.sqrt(mp.fsum((x - mean) ** 2 for x in squares) / len(v) / df)
        value, slope = (mp.sqrt(mean), 1 / (2 * mp.sqrt(mean))) if kind == "rms" else (mean, 1)
        half = t_one * error * slope
        if kind == "rms":
            factor = mp.exp(half / value)
            return [value, value / factor, value * factor]
        return [value, value - half, value + half]

    exactly = [exact(v) ** (2 if kind == "rms" else 1) for v in values]
    n = len(values)
    total, squares = sum(exactly), sum(v * v for v in exactly)
    error = rational.sqrt((squares / n - total * total / n / n) / df)
    value = total / n
    if kind == "rms":
        value = rational.sqrt(value)
        error = error / (2 * value)
    half = t_two * number(error)
    two = [number(value), number(value) - half, number(value) + half]
    if kind == "rms":
        two[1:] = [number(value) * sum_of_exponential(sign * half / number(value)) for sign in (-1, 1)]
    one = limits([mpf(v) for v in values])
    conditions = relative_condition(limits, [mpf(v) for v in values])
    for k, quantity in enumerate(("value", "low", "high")):
        problem.answer(quantity, "1", one[k], two[k], conditions[k] + (1 if k else 0))
    return problem


def test(name, level, about, kind, a, b):
    """Two-sided p value."""
    problem = Problem(name, level, about, {"pairing": kind, "a": a, "b": b})

    def statistic(values):
        a_, b_ = values[: len(a)], values[len(a) :]
        mean = lambda v: mp.fsum(v) / len(v)
        error2 = lambda v: mp.fsum((x - mean(v)) ** 2 for x in v) / (len(v) - 1) / len(v)
        if kind == "shared":
            d = [y - x for x, y in zip(a_, b_)]
            return mean(d) / mp.sqrt(error2(d)), mpf(len(d) - 1)
        one, two = error2(a_), error2(b_)
        df = (one + two) ** 2 / (one**2 / (len(a) - 1) + two**2 / (len(b) - 1))
        return (mean(b_) - mean(a_)) / mp.sqrt(one + two), df

    values = [mpf(v) for v in [*a, *b]]
    t, df = statistic(values)
    p = lambda v: [2 * student_tail(abs(statistic(v)[0]), statistic(v)[1])]
    one = p(values)[0]
    # The same with fractions up to the root, and an integral.
    fa, fb = [exact(v) for v in a], [exact(v) for v in b]
    moments = lambda v: (sum(v) / len(v), (sum(x * x for x in v) - sum(v) ** 2 / len(v)) / (len(v) - 1) / len(v))
    if kind == "shared":
        mean, error2 = moments([y - x for x, y in zip(fa, fb)])
        df2 = Fraction(len(a) - 1)
    else:
        (ma, ea), (mb, eb) = moments(fa), moments(fb)
        mean, error2 = mb - ma, ea + eb
        df2 = error2**2 / (ea**2 / (len(a) - 1) + eb**2 / (len(b) - 1))
    t2 = abs(mean) / rational.sqrt(error2)
    two = 2 * tail_integral(number(t2), number(df2))
    problem.answer("p", "1", one, two, relative_condition(p, values)[0] + 1)
    return problem


def by_place(name, level, about, places):
    """Mean over presses with limits over locations; `places`: values of each location."""
    problem = Problem(name, level, about, {"by_place": places})
    k, n = len(places), sum(len(p) for p in places)
    t_one = student_quantile(mpf(0.975), k - 1)
    t_two = T_TWO[k - 1](mpf(0.975))
    lengths = [len(p) for p in places]

    def limits(values):
        rest, groups = list(values), []
        for length in lengths:
            groups.append(rest[:length])
            rest = rest[length:]
        mean = mp.fsum(values) / n
        error = mp.sqrt(mp.fsum((mp.fsum(g) - len(g) * mean) ** 2 for g in groups) * k / (k - 1)) / n
        return [mean, mean - t_one * error, mean + t_one * error]

    values = [mpf(v) for p in places for v in p]
    one = limits(values)
    # Sum of the squares of (S - N m) as moments of the sums S and numbers N of the locations.
    sums = [(sum(exact(v) for v in p), len(p)) for p in places]
    mean = sum(s for s, _ in sums) / n
    squares = sum(s * s for s, _ in sums) - 2 * mean * sum(s * c for s, c in sums) + mean * mean * sum(c * c for _, c in sums)
    half = t_two * number(rational.sqrt(squares * k / (k - 1))) / n
    two = [number(mean), number(mean) - half, number(mean) + half]
    spread = abs(half) > 0
    conditions = relative_condition(limits, values) if spread else [mpf(1)] * 3
    for i, quantity in enumerate(("value", "low", "high")):
        problem.answer(quantity, "1", one[i], two[i], conditions[i] + (1 if i else 0))
    return problem


def share(name, level, about, trues, locations):
    """Exact binomial limits of a share of 0 or 1."""
    problem = Problem(name, level, about, {"share": [i < trues for i in range(locations)]})
    tail = mpf(0.025)
    one = tail ** (mpf(1) / locations)
    # The same root by Newton's method in fractions.
    target, x = exact(0.025), Fraction(1, 2)
    for _ in range(200):
        step = (x**locations - target) / (locations * x ** (locations - 1))
        x = rational.near(x - step)
        if abs(step) < Fraction(1, 1 << 250):
            break
    if trues:
        problem.answer("value", "1", Fraction(1), mpf(1), 1)
        problem.answer("low", "1", one, x, 1).answer("high", "1", Fraction(1), mpf(1), 1)
    else:
        problem.answer("value", "1", Fraction(0), mpf(0), 1)
        problem.answer("low", "1", Fraction(0), mpf(0), 1).answer("high", "1", 1 - one, 1 - x, one / (1 - one) + 1)
    return problem


def score(name, level, about, trues, locations):
    problem = Problem(name, level, about, {"score": [i < trues for i in range(locations)]})
    df, p = locations - 1, mpf(0.975)
    t_one = student_quantile(p, df)
    t_two = T_TWO[df](p) if df in T_TWO else student_quantile(p, df, tail_integral, float(t_one), 2)
    share_ = mpf(trues) / locations
    # p (1 - p) / s^2 of one trial per location, and the same from the definition of s.
    trials = locations - 1 if 0 < trues < locations else locations
    if 0 < trues < locations:
        squares = trues * (1 - share_) ** 2 + (locations - trues) * share_**2
        trials = share_ * (1 - share_) / (squares / (locations - 1) / locations)
        if abs(trials - (locations - 1)) > mpf(10) ** -50:
            raise ArithmeticError("effective trials")

    def wilson(c):
        square = c * c / trials
        half = mp.sqrt(square * (share_ * (1 - share_) + square / 4))
        return [(share_ + square / 2 + sign * half) / (1 + square) for sign in (-1, 1)]

    # Roots of (x - share)^2 = c^2 x (1 - x) / n as of a quadratic.
    b, a = -(2 * share_ + t_two**2 / trials), 1 + t_two**2 / trials
    root = mp.sqrt(b * b - 4 * a * share_**2)
    two = [(-b - root) / (2 * a), (-b + root) / (2 * a)]
    one = wilson(t_one)
    conditions = relative_condition(lambda v: wilson(v[0]), [t_one])
    problem.answer("value", "1", share_, Fraction(trues, locations), 1)
    for i, quantity in enumerate(("low", "high")):
        problem.answer(quantity, "1", one[i], two[i], conditions[i] + 1)
    return problem


def refused(name, about, kind, a, b, outcome):
    return Problem(name, "easy", about, {"pairing": kind, "a": a, "b": b}, outcome)


def problems():
    twenty = [0.0] * 19 + [1.0, 1e9]
    a, b = [2.5, 3.25, 2.75, 4.0, 3.5], [2.75, 3.0, 3.25, 4.5, 3.75]
    far, off = [1.0, 1.0009765625, 0.9990234375, 1.0, 1.00048828125, 1.0], [9.0, 9.0, 9.0009765625, 8.9990234375, 9.0, 9.0009765625]
    return [
        quantile("ties", "easy", "Median among ties", [1.0, 2.0, 2.0, 2.0, 3.0], 0.5),
        quantile("two-values", "easy", "Two values, a third of the way", [0.1, 0.3], 1.0 / 3.0),
        quantile("two-ends", "easy", "Two values, the upper end", [0.1, 0.3], 1.0),
        quantile("almost-rank", "hard", "0.95 is below 19 / 20 by 4e-17, which decides between order statistics", twenty, 0.95),
        quantile("huge-gap", "hard", "Neighbours 300 orders of magnitude apart", [1e-300, 1e-300, 1e150, 1e300], 0.625),
        quantile("opposite", "hard", "Interpolation through zero", [-1.0, 1.0000001], 0.5),
        quantile("empty", "easy", "No values", [], 0.5, "undefined"),
        quantile("beyond", "easy", "A quantile above 1", [1.0, 2.0], 1.0000000000000002, "undefined"),
        normal("normal-975", "easy", "Two-sided 95 %", 0.975),
        normal("normal-1e-10", "average", "Far in the lower tail", 1e-10),
        normal("normal-1e-300", "hard", "At the end of doubles", 1e-300),
        normal("normal-middle", "hard", "Just above one half", 0.500000059604644775390625),
        student("student-1", "easy", "Two values: Cauchy's distribution", 0.975, 1.0, T_TWO[1]),
        student("student-2", "easy", "Three values", 0.975, 2.0, T_TWO[2]),
        student("student-7.3", "average", "Degrees of freedom after Welch", 0.975, 7.25),
        student("student-1-tail", "hard", "1e-10 with one degree of freedom", 1e-10, 1.0, T_TWO[1]),
        student("student-million", "hard", "A million degrees of freedom", 0.975, 1e6),
        probability("probability-tail", "average", "Thirty standard errors below", -30.0, 7.25),
        probability("probability-million", "hard", "A million degrees of freedom", -2.0, 1e6),
        probability("probability-2-31", "hard", "2^31 degrees of freedom", -2.0, 2.0**31),
        interval("mean-of-two", "easy", "Mean of two values", "mean", [0.1, 0.3]),
        interval("mean-of-ties", "average", "Mean of seven values with ties", "mean", [1.5, 1.5, 1.5, 2.5, 2.5, 1.5, 7.75]),
        interval("mean-offset", "hard", "Values that agree to seven digits", "mean", [1e6 + 0.125, 1e6 + 0.25, 1e6 + 0.125]),
        interval("rms-of-two", "average", "Root mean square of two values", "rms", [3.0, 4.0]),
        test("paired", "easy", "Five shared locations", "shared", a, b),
        test("welch", "average", "Independent samples of different spread", "independent", a, [2.0, 6.5, 3.5]),
        test("far-below", "hard", "b far below a", "shared", off, far),
        test("far-above", "hard", "b far above a: the same p value", "shared", far, off),
        refused("no-spread", "The same difference at each location", "shared", [1.0, 2.0, 3.0], [1.5, 2.5, 3.5], "no spread"),
        refused("one-location", "One location", "shared", [1.0], [1.5], "too few"),
        by_place("places-two", "easy", "Two locations", [[0.1], [0.3]]),
        by_place("places-ties", "easy", "Three equal locations", [[0.1], [0.1], [0.1]]),
        by_place("places-uneven", "average", "Two locations with one and three presses", [[1.25], [0.5, 0.75, 0.5]]),
        by_place("places-three", "average", "Three locations, two of them tied", [[2.5], [2.5], [-1.0]]),
        share("share-all-of-two", "average", "All of two locations", 2, 2),
        share("share-none-of-nine", "average", "None of nine locations", 0, 9),
        score("score-half-of-two", "average", "One of two locations", 1, 2),
        score("score-none-of-two", "average", "None of two locations", 0, 2),
    ]
