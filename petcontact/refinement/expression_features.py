"""Where a function along a side is rough or narrow.

Kinks and jumps are found on the sampled function. Samples never show a peak that is narrower than
their spacing; the text of the function does: what is small or singular somewhere has a
sub-expression that vanishes or turns there, as x - 3 does in exp(-((x - 3)/1e-6)**2).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Container, Iterator

import numpy as np

from ..arrays import Array, Index, Mask
from ..geometry.same_place import TOLERANCE
from ..model.expressions import Value, parse_expression, plain_value
from ..round_off import ROUNDED

SAMPLES = 4096
"""Uniform samples of a side."""
HALVINGS = 79
"""Samples on either side of a centre: at the distances 2^(-j/2), j = 2 ... HALVINGS, of the side's
length."""
NARROWEST = 2.0 ** (-0.5 * HALVINGS)
"""Distance of the samples next to a centre: of two that are closer the samples are the same."""
MOST_CENTRES = 64
"""Places at which one sub-expression vanishes or turns that get samples of their own."""
BISECTIONS = 60
CONSTANT = frozenset({"pi", "e", "nx", "ny"})
"""Names that stand for one number on a straight line."""
MOST_KINKS = 512
"""Candidates of one function; more of them are a function that is rough everywhere."""
PARTS, ROUNDS = 8, 24
"""Into how many parts the interval around a candidate is cut, and how often at most: a quarter of
it is left each time, 4^-24 of the first in the end."""
MARGIN = 1e-3
"""Of an interval, by which the next one reaches beyond its parts: a jump may lie at their end."""
DIGITS = 1e3 * np.finfo(float).eps
"""Change of slope times the interval over the size of the function that is round-off."""
NEXT = 8.0 * TOLERANCE
"""Width of neighbouring samples between which a function changes its slope by its noise only
(J. J. Moré and S. M. Wild, Estimating computational noise, SIAM J. Sci. Comput. 33, 2011)."""
NOISE = 16.0
"""The largest of thousands of changes by noise over their median; of normal ones it is 7."""
SMOOTH = 0.75
"""Power of the interval with which the change of slope falls from which on a function is smooth: it
is 1 where there is a curvature, 0 at a kink, -1 at a jump."""
BEFORE = 3
"""Intervals back that this power is taken over."""

Variables = Callable[[Array], dict[str, Array]]


def samples_of(text: str, variables: Variables) -> Array:
    """Fractions in [0, 1] that miss no peak of an expression on a side, increasing (n,).

    Parameters
    ----------
    text : str
        An expression that `evaluate` accepts.
    variables : callable
        Fractions (n,) of the side to the expression's variables there, (n,) each.

    Raises
    ------
    InputError
        If the expression cannot be read.
    """
    done = np.array([0.0, 1.0])
    samples = _around(done, uniform())
    known = variables(samples)
    # a sub-expression that stands there again shows what it showed
    parts = {ast.dump(node): node for node in _parts(parse_expression(text), known)}
    for node in parts.values():
        values = plain_value(node, known, len(samples))
        centres = np.concatenate(
            [_zeros(node, variables, samples, values), _turns(samples, values)]
        )
        centres = centres[:: max(1, len(centres) // MOST_CENTRES)]
        centres = centres[(np.abs(centres[:, None] - done) > NARROWEST).all(axis=1)]
        if len(centres):
            done, samples = np.append(done, centres), _around(centres, samples)
            known = variables(samples)
    return samples


def kinks(
    values: Callable[[Array], Array], samples: Array, sampled: Array, far: float = 1.0
) -> tuple[Array, Array]:
    """Places inside a side at which a function has a kink or a jump, as fractions, in any order,
    and the power of the distance with which its slope changes there: -1 at a jump, 0 at a kink.

    Around each sample where the slope changes more than at those beside it, the part of the
    interval with the largest change is cut again and again: where the function is smooth the change
    falls with the interval, at a kink it stays, at a jump it grows.

    Parameters
    ----------
    values : callable
        Fractions (n,) to values (n,).
    samples, sampled : (n,) arrays
        Increasing fractions, and the values there.
    far : float, optional
        The largest coordinate over the length of the side: so many times as large is the round-off
        of a place, and that of values with it.
    """
    apart = np.append(True, np.diff(samples) > TOLERANCE)
    samples, sampled = samples[apart], sampled[apart]
    change = np.abs(np.diff(np.diff(sampled) / np.diff(samples)))
    far = float(DIGITS * max(1.0, far))
    width = samples[2:] - samples[:-2]
    size = float(np.abs(sampled).max(initial=0.0)) * far
    if (width < NEXT).any():  # of what cancels, the digits of what it is a difference of
        size = max(size, NOISE * float(np.median((change * width)[width < NEXT])))
    here = _candidates(change, width, size)
    if not 0 < len(here) <= MOST_KINKS:
        return np.empty(0), np.empty(0)
    low, width = samples[here], samples[here + 2] - samples[here]
    widths, changes = [width], [change[here]]
    for _ in range(ROUNDS):
        first, largest = _sharpest(values, low, width)
        here = (largest * width > PARTS * size) & (width > PARTS * far)
        if not here.any():
            break
        low = np.where(here, first - MARGIN * width, low)
        width = np.where(here, (2.0 / PARTS + 2.0 * MARGIN) * width, width)
        widths.append(width)
        changes.append(np.where(here, largest, changes[-1]))
    power = _powers(np.array(widths), np.array(changes))
    return (low + 0.5 * width)[power < SMOOTH], power[power < SMOOTH]


def _sharpest(values: Callable[[Array], Array], low: Array, width: Array) -> tuple[Array, Array]:
    """Where in each interval the two parts begin between which the slope changes most, and by how
    much."""
    step = width / PARTS
    at = low + step * np.arange(PARTS + 1)[:, None]
    slope = np.diff(values(at.ravel()).reshape(at.shape), axis=0) / step
    turn = np.abs(np.diff(slope, axis=0))
    return low + turn.argmax(axis=0) * step, turn.max(axis=0)


def _candidates(change: Array, width: Array, least: float) -> Index:
    """Where the change of slope over its interval is largest, beside its neighbours' and beyond
    round-off."""
    bent = np.where(change * width > least, change / width, 0.0)
    most = np.concatenate([[0.0], bent, [0.0]])
    return np.flatnonzero((bent > 0.0) & (bent >= most[:-2]) & (bent >= most[2:]))


def _powers(width: Array, change: Array) -> Array:
    """By intervals and changes of slope (k, n), the last ones repeated where there are no more."""
    last, each = (width > width[-1]).sum(axis=0), np.arange(width.shape[1])
    first = np.maximum(0, last - BEFORE)
    narrower = np.log(width[first, each] / width[last, each])
    falls = np.log(change[first, each] / change[last, each])
    return np.asarray(
        np.where(narrower > 0.0, falls / np.where(narrower > 0.0, narrower, 1.0), 1.0)
    )


def degree(value: Value) -> float:
    """Degree of a number or an expression as a polynomial of the place on a straight line; infinite
    where it is none.

    Examples
    --------
    >>> degree("1e-3*(x**2 + y*s)/4 - nx"), degree("sin(x)"), degree(2.0)
    (2.0, inf, 0.0)
    """
    if isinstance(value, str):
        return _degree(parse_expression(value))
    return 0.0 if isinstance(value, float | int) else math.inf


def _degree(node: ast.expr) -> float:
    if isinstance(node, ast.Constant):
        return 0.0
    if isinstance(node, ast.Name):
        return 0.0 if node.id in CONSTANT else 1.0
    if isinstance(node, ast.UnaryOp):
        return _degree(node.operand) if isinstance(node.op, ast.USub) else math.inf
    if isinstance(node, ast.BinOp):
        left, right = _degree(node.left), _degree(node.right)
        if isinstance(node.op, ast.Add | ast.Sub):
            return max(left, right)
        if isinstance(node.op, ast.Mult):
            return left + right
        if (
            isinstance(node.op, ast.Pow)
            and isinstance(node.right, ast.Constant)
            and _is_whole(node.right)
        ):
            return left * float(node.right.value)  # type: ignore[arg-type]
        return left if isinstance(node.op, ast.Div) and right == 0.0 else math.inf
    return math.inf


def _parts(tree: ast.expr, names: Container[str]) -> Iterator[ast.expr]:
    """Sub-expressions that may vanish or turn, inner ones first; `names`: of the variables."""
    for node in reversed(list(ast.walk(tree))):
        if isinstance(node, ast.Compare):
            yield ast.BinOp(node.left, ast.Sub(), node.comparators[0])
        elif isinstance(node, ast.BinOp | ast.Call) or (
            isinstance(node, ast.Name) and node.id in names
        ):
            yield node


def _is_whole(node: ast.expr) -> bool:
    value = node.value if isinstance(node, ast.Constant) else None
    return isinstance(value, (int, float)) and value >= 0 and value % 1 == 0


def _values(node: ast.expr, variables: Variables, at: Array) -> Array:
    return plain_value(node, variables(at), len(at))


def uniform() -> Array:
    """Samples in equal intervals, one in each at a place of its own, so that no wave is zero at all
    of them."""
    offset = np.random.default_rng(4096).random(SAMPLES)
    return np.asarray((np.arange(SAMPLES) + offset) / SAMPLES)


def _around(centres: Array, samples: Array) -> Array:
    distance = 2.0 ** (-0.5 * np.arange(2, HALVINGS + 1))
    distance = np.concatenate([-distance, [0.0], distance])
    more = (centres[:, None] + distance).ravel()
    return np.asarray(np.unique(np.concatenate([samples, more[(more >= 0.0) & (more <= 1.0)]])))


def _zeros(node: ast.expr, variables: Variables, at: Array, values: Array) -> Array:
    """Where a sub-expression vanishes: samples at which it does (the ends of runs of them), changes
    of sign, bisected."""
    zero: Mask = values == 0.0
    edges = zero & ~(np.append(zero[1:], False) & np.insert(zero[:-1], 0, False))
    sign = np.sign(values)
    cut = np.flatnonzero(sign[1:] * sign[:-1] < 0.0)
    low, high, below = at[cut], at[cut + 1], sign[cut]
    if len(cut) > SAMPLES // 8:
        return at[edges]  # rough everywhere: samples see it
    for _ in range(BISECTIONS if len(cut) else 0):
        middle = 0.5 * (low + high)
        same = np.sign(_values(node, variables, middle)) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.concatenate([at[edges], high])


def _turns(at: Array, values: Array) -> Array:
    """Samples at which a sub-expression has a maximum or a minimum beyond the round-off of it."""
    least = ROUNDED * np.minimum(np.abs(values[1:]), np.abs(values[:-1]))
    with np.errstate(invalid="ignore"):  # of two infinite ones
        rise = (values[1:] > values[:-1] + least) * 1 - (values[1:] < values[:-1] - least)
    moves = np.flatnonzero(rise)
    return np.asarray(at[moves[1:]][rise[moves[1:]] * rise[moves[:-1]] < 0.0])
