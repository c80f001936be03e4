"""Density clusters (DBSCAN) of events on pixels.

Method A: every pixel against every other, sums of fractions about the mean.
Method B: growth from pixel to pixel, integer moments, square roots in mpmath.
"""

from fractions import Fraction

from mpmath import mp, mpf

import rational
from certify import Problem, exact

NAME = "clusters"
ABOUT = (
    "DBSCAN on events at pixels [u, v, count]: a pixel is core if the disc of radius eps_px about it (border included) holds at "
    "least min_samples events, its own included; core pixels within eps are one cluster; another pixel within eps of a core pixel "
    "belongs to the cluster of the nearest one, in ties of the first by row, then column. Answers are the number of clusters and, "
    "for the largest (of equal ones the one whose first core pixel by row, then column, comes first), its events, mean column and "
    "row, and their standard deviations divided by n. Pixels are integers: condition numbers are those for changes of counts."
)


def row_first(pixel):
    return (pixel[1], pixel[0])


def near(a, b, square):
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 <= square


def by_pairs(pixels, eps, least):
    """Clusters as lists of pixels, in order of their first core pixels: labels spread until nothing changes."""
    square = exact(eps) ** 2
    core = [p for p in pixels if sum(q[2] for q in pixels if near(p, q, square)) >= least]
    core.sort(key=row_first)
    label = list(range(len(core)))
    changed = True
    while changed:
        changed = False
        for i, p in enumerate(core):
            lowest = min(label[j] for j, q in enumerate(core) if near(p, q, square))
            changed |= lowest != label[i]
            label[i] = lowest
    members = {first: [] for first in sorted(set(label))}
    for p in pixels:
        reached = [
            ((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2, row_first(q), label[i])
            for i, q in enumerate(core)
            if near(p, q, square)
        ]
        if reached:
            members[min(reached)[2]].append(p)
    return list(members.values())


def by_growth(pixels, eps, least):
    """The same by a search from each core pixel that has no cluster yet, in order."""
    reach = int(eps)
    counts = {(u, v): n for u, v, n in pixels}
    square = Fraction(eps) * Fraction(eps)
    steps = [
        (a * a + b * b, b, a)
        for a in range(-reach, reach + 1)
        for b in range(-reach, reach + 1)
        if a * a + b * b <= square
    ]
    around = lambda p: [(p[0] + a, p[1] + b) for _, b, a in steps]
    core = {p for p in counts if sum(counts.get(q, 0) for q in around(p)) >= least}
    cluster, number = {}, 0
    for p in sorted(core, key=row_first):
        if p in cluster:
            continue
        cluster[p], queue = number, [p]
        while queue:
            for q in around(queue.pop()):
                if q in core and q not in cluster:
                    cluster[q] = number
                    queue.append(q)
        number += 1
    groups = [[] for _ in range(number)]
    for (u, v), n in counts.items():
        for _, b, a in sorted(steps):
            if (u + a, v + b) in core:
                groups[cluster[(u + a, v + b)]].append((u, v, n))
                break
    return groups


def largest(groups):
    return max(groups, key=lambda g: sum(p[2] for p in g)) if groups else None


def exact_moments(group):
    n = sum(p[2] for p in group)
    found = [Fraction(n)]
    for axis in range(2):
        mean = sum(Fraction(p[axis] * p[2], n) for p in group)
        variance = sum((p[axis] - mean) ** 2 * p[2] for p in group) / n
        found += [mean, rational.sqrt(variance)]
    return [found[i] for i in (0, 1, 3, 2, 4)]


def integer_moments(group):
    n = sum(p[2] for p in group)
    means, spreads = [], []
    for axis in range(2):
        total = sum(p[axis] * p[2] for p in group)
        squares = sum(p[axis] ** 2 * p[2] for p in group)
        means.append(mpf(total) / n)
        spreads.append(mp.sqrt(n * squares - total * total) / n)
    return [mpf(n), *means, *spreads]


def conditions(group):
    n, u, v, su, sv = exact_moments(group)
    found = [1]
    for axis, mean in ((0, u), (1, v)):
        change = sum(abs(p[axis] - mean) * p[2] for p in group) / n
        found.append(change / mean if mean else change)
    for axis, mean, spread in ((0, u, su), (1, v, sv)):
        variance = sum((p[axis] - mean) ** 2 * p[2] for p in group) / n
        change = sum(abs((p[axis] - mean) ** 2 - variance) * p[2] for p in group) / n
        found.append(change / (2 * variance) if variance else 0)
    return found


def cluster(name, level, about, eps, least, pixels, outcome="solved"):
    inputs = {"eps_px": eps, "min_samples": least, "pixels": [list(p) for p in pixels]}
    problem = Problem(name, level, about, inputs, outcome)
    if outcome == "overflow":
        return problem
    one, two = by_pairs(pixels, eps, least), by_growth(pixels, eps, least)
    problem.answer("clusters", "1", Fraction(len(one)), mpf(len(two)), 0)
    if not one:
        return problem
    quantities = [("events", "1"), ("mean_u", "px"), ("mean_v", "px"), ("spread_u", "px"), ("spread_v", "px")]
    a, b, condition = exact_moments(largest(one)), integer_moments(largest(two)), conditions(largest(one))
    for i, (quantity, unit) in enumerate(quantities):
        problem.answer(quantity, unit, a[i], b[i], condition[i])
    return problem


def problems():
    blob = [(300 + i % 7, 240 + i // 7, 1 + (i * 5) % 4) for i in range(35)]
    half = 2**31
    return [
        cluster("blob", "easy", "A blob of 35 pixels", 10.0, 10, blob),
        cluster("at-eps", "average", "Two pixels exactly eps apart: 6-8-10", 10.0, 5, [(100, 100, 3), (106, 108, 2)]),
        cluster("beyond-eps", "average", "The same, one pixel further", 10.0, 5, [(100, 100, 5), (107, 108, 5)]),
        cluster("at-min-samples", "average", "Discs with exactly min_samples events", 3.0, 7, [(10, 10, 4), (12, 12, 3), (50, 10, 3), (52, 12, 3)]),
        cluster("equal-clusters", "average", "Two largest clusters of equal size: the first by row", 4.0, 6, [(400, 300, 6), (402, 301, 2), (200, 299, 5), (203, 300, 3)]),
        cluster("border-tie", "hard", "A border pixel equally far from two clusters", 5.0, 20, [(96, 100, 18), (100, 100, 2), (105, 100, 1), (110, 100, 2), (114, 100, 28)]),
        cluster("border-nearer", "hard", "A border pixel nearer to the smaller cluster", 5.0, 20, [(96, 100, 18), (100, 100, 2), (104, 100, 1), (109, 100, 2), (113, 100, 28)]),
        cluster("one-pixel", "average", "2^31 events on one pixel", 10.0, 10, [(639, 479, half)]),
        cluster("half-and-half", "hard", "2^31 and 2^31 - 1 events on two pixels", 10.0, 10, [(639, 479, half), (630, 476, half - 1)]),
        cluster("one-away", "hard", "2^32 - 2 events on a pixel and one event 9 px away", 10.0, 10, [(639, 479, 2 * half - 2), (630, 479, 1)]),
        cluster("a-billion", "hard", "10^9 events in a row of pixels", 2.0, 1000, [(u, 250, 5_000_000 + (u * 7919) % 1009) for u in range(220, 420)]),
        cluster("overflow", "hard", "2^32 events: one too many", 10.0, 10, [(639, 479, half), (630, 476, half)], "overflow"),
        cluster("noise", "easy", "Events too far apart for a cluster", 2.0, 2, [(5, 5, 1), (9, 9, 1)], "none"),
    ]
