"""Problems with answers on which two methods agree, and the files that hold them."""

import csv
import io
import json
from fractions import Fraction

from mpmath import mp, mpf

# Digits of the first method, digits on which both must agree, and digits written.
mp.dps = 60
AGREED = 30
WRITTEN = 30
# Both methods must be this near zero where the answer is zero.
ZERO = mpf(10) ** -40


class Disagreement(Exception):
    """The two methods do not agree: nothing is written."""


def number(value):
    """A number of either method as mpf."""
    if isinstance(value, Fraction):
        return mpf(value.numerator) / mpf(value.denominator)
    return mpf(value)


def exact(value):
    """The exact value of a double."""
    return Fraction(value)


def certified(where, one, two):
    """The decimal form of an answer; raises unless both methods give it."""
    one, two = number(one), number(two)
    if abs(one) < ZERO and abs(two) < ZERO:
        return "0"
    if abs(one - two) > abs(one) * mpf(10) ** -AGREED:
        raise Disagreement(f"{where}: {mp.nstr(one, 40)} and {mp.nstr(two, 40)}")
    return mp.nstr(one, WRITTEN, strip_zeros=True, min_fixed=-5, max_fixed=20)


def rounded(condition):
    """A condition number with two digits."""
    return float(mp.nstr(number(condition), 2))


def relative_condition(function, inputs):
    """Condition numbers of several answers: sums of |dy/dx x| over all inputs, divided by |y| (by 1 where y is 0)."""
    step = mpf(10) ** -20
    base = function(inputs)
    totals = [mpf(0)] * len(base)
    for i, value in enumerate(inputs):
        if value == 0:
            continue
        moved = list(inputs)
        moved[i] = value * (1 + step)
        for k, found in enumerate(function(moved)):
            totals[k] += abs(found - base[k]) / step
    return [t / (abs(y) if abs(y) > ZERO else 1) for t, y in zip(totals, base)]


class Problem:
    """A problem: inputs that are doubles or integers, and answers or an outcome without answers."""

    def __init__(self, name, level, about, inputs, outcome="solved"):
        self.name, self.level, self.about = name, level, about
        self.inputs, self.outcome, self.answers = inputs, outcome, []

    def answer(self, quantity, unit, one, two, condition):
        """Adds an answer; `one` and `two` come from independent methods."""
        value = certified(f"{self.name}, {quantity}", one, two)
        self.answers.append(
            {"quantity": quantity, "unit": unit, "value": value, "condition": rounded(condition)}
        )
        return self

    def as_json(self):
        return {
            "name": self.name,
            "level": self.level,
            "about": self.about,
            "outcome": self.outcome,
            "inputs": self.inputs,
            "answers": self.answers,
        }


def family_json(name, about, problems):
    """The text of the file of a family: one line for each input and answer."""
    dump = json.dumps
    lines = ["{", f'"family": {dump(name)},', f'"about": {dump(about)},']
    lines += ['"licence": "MIT OR Apache-2.0",', '"problems": [']
    for i, problem in enumerate(problems):
        whole = problem.as_json()
        lines.append("{")
        lines += [f"{dump(k)}: {dump(whole[k])}," for k in ("name", "level", "about", "outcome")]
        inputs = [f"  {dump(k)}: {dump(v)}" for k, v in whole["inputs"].items()]
        lines += ['"inputs": {', ",\n".join(inputs), "},", '"answers": [']
        lines.append(",\n".join(f"  {dump(a)}" for a in whole["answers"]))
        lines += ["]", "}" + ("," if i + 1 < len(problems) else "")]
    return "\n".join(line for line in lines if line) + "\n]\n}\n"


def flat(value, path=""):
    """(path, number or word) of everything in nested lists and objects."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flat(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, (list, tuple)):
        for i, inner in enumerate(value):
            yield from flat(inner, f"{path}.{i}")
    else:
        yield path, value if isinstance(value, str) else json.dumps(value)


def tables(families):
    """The texts of inputs.csv and answers.csv."""
    inputs, answers = io.StringIO(), io.StringIO()
    into, out = csv.writer(inputs, lineterminator="\n"), csv.writer(answers, lineterminator="\n")
    into.writerow(["family", "problem", "input", "value"])
    out.writerow(["family", "problem", "level", "outcome", "quantity", "unit", "value", "condition"])
    for family, problems in families:
        for p in problems:
            for path, value in flat(p.inputs):
                into.writerow([family, p.name, path, value])
            for a in p.answers or [{"quantity": "", "unit": "", "value": "", "condition": ""}]:
                cells = [a["quantity"], a["unit"], a["value"], a["condition"]]
                out.writerow([family, p.name, p.level, p.outcome, *cells])
    return inputs.getvalue(), answers.getvalue()
