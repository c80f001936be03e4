"""Elementary functions on exact fractions, to 2^-400, from integer arithmetic alone: the second method shares no code with mpmath."""

from fractions import Fraction
from math import isqrt

BITS = 400
ONE = 1 << BITS


def near(q):
    """The nearest multiple of 2^-BITS."""
    return Fraction((2 * q.numerator * ONE + q.denominator) // (2 * q.denominator), ONE)


def sqrt(q):
    """Square root; 100 digits also of small numbers."""
    shift = 2 * BITS
    return Fraction(isqrt((q.numerator << (2 * shift)) // q.denominator), 1 << shift)


def _taylor(x, first, ratio):
    """Sum of a series in integers: each term is the one before times x and `ratio(k)` (numerator, denominator)."""
    term, total, k = first, first, 0
    while term:
        up, down = ratio(k)
        term = (term * x * up) // (down << BITS)
        if term == -1:
            term = 0
        total += term
        k += 1
    return total


def exp(q):
    """Exponential, by the series of q / 2^64."""
    x = (q.numerator << BITS) // q.denominator
    extra = 96
    wide = BITS + extra
    y = (x << extra) >> 64
    term = total = 1 << wide
    k = 1
    while term:
        term = (term * y >> wide) // k
        if term == -1:
            term = 0
        total += term
        k += 1
    for _ in range(64):
        total = total * total >> wide
    return Fraction(total, 1 << wide)


def sin_cos(q):
    """Sine and cosine of an angle of a few radians."""
    x = (q.numerator << BITS) // q.denominator
    square = x * x >> BITS
    sin = _taylor(square, x, lambda k: (-1, (2 * k + 2) * (2 * k + 3)))
    cos = _taylor(square, ONE, lambda k: (-1, (2 * k + 1) * (2 * k + 2)))
    return Fraction(sin, ONE), Fraction(cos, ONE)


def _atan_inverse(n):
    """atan(1 / n) times 2^BITS, with guard bits dropped."""
    guard = 32
    power = (ONE << guard) // n
    total, k = power, 1
    while power:
        power //= n * n
        total += (-power if k % 2 else power) // (2 * k + 1)
        k += 1
    return total >> guard


PI = Fraction(4 * (4 * _atan_inverse(5) - _atan_inverse(239)), ONE)


def atan(q):
    """Arc tangent, by halving the angle until the series is fast."""
    halvings = 0
    while abs(q) > Fraction(1, 1 << 12):
        q = near(q / (1 + sqrt(1 + q * q)))
        halvings += 1
    x = (q.numerator << BITS) // q.denominator
    square = x * x >> BITS
    power, total, k = x, x, 1
    while power not in (0, -1):
        power = -(power * square) >> BITS
        total += power // (2 * k + 1)
        k += 1
    return Fraction(total << halvings, ONE)


def radians(degrees):
    return degrees * PI / 180
