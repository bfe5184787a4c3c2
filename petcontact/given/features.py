"""Points at which a function along a side is rough or narrow.

Kinks and jumps are found from samples of the function. Samples do not show a peak that is narrower
than their spacing, but the text of the expression does. A feature that is narrow or singular
contains a sub-expression that vanishes or has an extremum there. An example is x - 3 in exp(-((x -
3)/1e-6)**2).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Container, Iterator

import numpy as np

from ..arrays import Array, Index, Mask
from ..geometry.same_place import SMALLEST, TOLERANCE
from ..round_off import ROUNDED, SUMMED
from .expressions import parse_expression, plain_value
from .sites import Way

SAMPLES = 4096
"""Uniform samples of a side."""
CONSTANT = frozenset({"pi", "e", "nx", "ny"})
"""Names that are constant on a straight line."""
PARTS = 8
"""Parts of the interval around a candidate, of which each round keeps a quarter."""
ROUNDS = 20
"""Rounds of `PARTS` parts after which an interval has the size of its round-off."""
MOST_FEATURES = SAMPLES // PARTS
"""Largest number of zeros, extrema or candidates of a function, and of elements that resolve it:
with more it is rough everywhere."""
NEXT = PARTS * TOLERANCE
"""Width of neighbouring samples up to which a change of slope is only noise [-] (J. J. Moré and S.
M. Wild, Estimating computational noise, SIAM J. Sci. Comput. 33, 2011)."""
MEASURED = 128
"""Places at which noise is measured: its median is known to a tenth."""
NOISE = 16.0
"""Largest of thousands of changes by noise over their median [-]; it is 7 for a normal
distribution."""
SMOOTH = 0.75
"""Power of the interval with which the change of slope falls, from which a function is smooth [-].
The power is 1 at a curvature, 0 at a kink, -1 at a jump, which is below -`SMOOTH`."""


def features_of(text: str, way: Way) -> tuple[Array, Array]:
    """Return where every peak of an expression on a side lies, and fractions that resolve it.

    Parameters
    ----------
    text : str
        An expression.
    way : callable
        The side, see `Way`.

    Returns
    -------
    centres : (k,) array
        Fractions in [0, 1] at which sub-expressions vanish or have an extremum, and both ends.
    samples : (n,) array
        Increasing fractions in [0, 1].

    Raises
    ------
    InputError
        If the expression cannot be read.
    """
    done = np.array([0.0, 1.0])
    samples = _around(done, uniform())
    names = way(samples).names
    # each sub-expression is examined once
    parts = {ast.dump(node): node for node in _parts(parse_expression(text), names)}
    for node in parts.values():
        values = plain_value(node, names, len(samples))
        centres = np.concatenate([_zeros(node, way, samples, values), _turns(samples, values)])
        centres = centres[:: max(1, len(centres) // MOST_FEATURES)]
        # closer centres share samples
        apart = np.abs(centres[:, None] - done) > SMALLEST
        centres = centres[apart.all(axis=1)]
        if len(centres):
            done, samples = np.append(done, centres), _around(centres, samples)
            names = way(samples).names
    return done, samples


def where_zero(values: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Return the fractions of a line at which functions change sign, and others that resolve what
    is rough there.

    Parameters
    ----------
    values : callable
        Function from fractions (n,) to values (k, n).
    """
    samples = uniform()
    ends = np.concatenate([[0.0], samples, [1.0]])
    below = values(ends) < 0.0
    row, cut = np.nonzero(below[:, 1:] != below[:, :-1])

    def same(points: Array) -> Mask:
        found = values(points.ravel()).reshape(-1, *points.shape)
        return np.asarray((found[row, :, np.arange(len(row))].T < 0.0) == below[row, cut])

    high = _changes(same, ends[cut], ends[cut + 1])
    return high, _around(high, samples) if len(high) else samples


def kinks(
    values: Callable[[Array], Array], samples: Array, sampled: Array, far: float = 1.0
) -> tuple[Array, Array]:
    """Return the fractions inside a side at which a function has a kink or a jump, and their
    powers.

    The power is that of the distance with which the slope changes: -1 at a jump, 0 at a kink. The
    fractions increase. Candidates are samples at which the slope changes more than at their
    neighbours. The part of the interval around a candidate with the largest change is cut
    repeatedly. There the change falls with the interval if the function is smooth. It stays
    constant at a kink, and grows at a jump.

    Parameters
    ----------
    values : callable
        Function from fractions (n,) to values (n,).
    samples, sampled : (n,) arrays
        Increasing fractions, and the values there.
    far : float, optional
        Largest coordinate over the length of the side. It multiplies the round-off of positions and
        therefore that of values.
    """
    apart = np.append(True, np.diff(samples) > TOLERANCE)
    samples, sampled = samples[apart], sampled[apart]
    change = np.abs(np.diff(np.diff(sampled) / np.diff(samples)))
    far = float(SUMMED * max(1.0, far))
    width = samples[2:] - samples[:-2]
    size = max(far * float(np.abs(sampled).max(initial=0.0)), NOISE * _noise(values, samples))
    chosen = _candidates(change, width, size)
    if not 0 < len(chosen) <= MOST_FEATURES:
        return np.empty(0), np.empty(0)
    low, width = samples[chosen], samples[chosen + 2] - samples[chosen]
    widths, changes = [width], [change[chosen]]
    while True:
        first, largest = _sharpest(values, low, width)
        chosen = (largest * width > PARTS * size) & (width > PARTS * far)
        if not chosen.any():
            break
        # a jump may lie at the end of its parts: the next interval reaches beyond them by a share
        # of 1 / PARTS
        low = np.where(chosen, first - width / PARTS**2, low)
        width = np.where(chosen, 2.0 * (1.0 + 1.0 / PARTS) / PARTS * width, width)
        widths.append(width)
        changes.append(np.where(chosen, largest, changes[-1]))
    power, place = _powers(np.array(widths), np.array(changes)), low + 0.5 * width
    chosen = np.flatnonzero(power < SMOOTH)
    chosen = chosen[np.argsort(place[chosen])]
    # one midway between two samples is found from both
    chosen = chosen[np.diff(place[chosen], prepend=-1.0) > TOLERANCE]
    return place[chosen], power[chosen]


def _noise(values: Callable[[Array], Array], samples: Array) -> float:
    """Return the median change of slope over its interval, in intervals that show noise only."""
    middle = np.clip(samples[:: max(1, len(samples) // MEASURED)], NEXT, 1.0 - NEXT)
    places = middle + 0.25 * NEXT * np.array([[-1], [0], [1]])
    low, own, high = values(places.ravel()).reshape(places.shape)
    return float(np.median(2.0 * np.abs(high - 2.0 * own + low)))


def _sharpest(values: Callable[[Array], Array], low: Array, width: Array) -> tuple[Array, Array]:
    """Return the start of the two parts of each interval between which the slope changes most, and
    the change."""
    step = width / PARTS
    points = low + step * np.arange(PARTS + 1)[:, None]
    slope = np.diff(values(points.ravel()).reshape(points.shape), axis=0) / step
    turn = np.abs(np.diff(slope, axis=0))
    return low + turn.argmax(axis=0) * step, turn.max(axis=0)


def _candidates(change: Array, width: Array, least: float) -> Index:
    """Return the samples at which the change of slope over its interval exceeds its neighbours and
    round-off.

    A kink between two samples shows at both. Along a parabola all changes differ by round-off only.
    """
    bent = np.where(change * width > least, change / width, 0.0)
    most, noise = np.pad(bent, 1), np.pad(least / width**2, 1)
    before, after = most[:-2], most[2:]
    noise = np.maximum(noise[1:-1], np.maximum(noise[:-2], noise[2:]))
    larger = (bent >= np.maximum(before, after)) & (bent - np.minimum(before, after) > noise)
    return np.flatnonzero(larger & (bent > 0.0))


def _powers(width: Array, change: Array) -> Array:
    """Return the powers (n,) with which changes of slope fall with the intervals, both (k, n).

    Rows after the last round of a candidate repeat it.
    """
    last, columns = (width > width[-1]).sum(axis=0), np.arange(width.shape[1])
    first = np.maximum(0, last - 3)
    narrower = np.log(width[first, columns] / width[last, columns])
    falls = np.log(change[first, columns] / change[last, columns])
    return np.asarray(
        np.where(narrower > 0.0, falls / np.where(narrower > 0.0, narrower, 1.0), 1.0)
    )


def degree(text: str) -> float:
    """Return the degree of an expression as a polynomial on a straight line.

    It is infinite if the expression is no polynomial.

    Examples
    --------
    >>> degree("1e-3*(x**2 + y*s)/4 - nx"), degree("sin(x)")
    (2.0, inf)
    """
    return _degree(parse_expression(text))


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
    """Yield sub-expressions that may vanish or have an extremum, inner ones first.

    `names` are the variables.
    """
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


def uniform() -> Array:
    """Return one sample in each of equal intervals, at different positions in them.

    Thus no wave vanishes at all samples.
    """
    offset = np.random.default_rng(4096).random(SAMPLES)
    return np.asarray((np.arange(SAMPLES) + offset) / SAMPLES)


def _around(centres: Array, samples: Array) -> Array:
    """Return samples with more of them beside centres, down to the size of the smallest elements.

    Each distance from a centre is that of the sample before over √2.
    """
    distance = 0.5 ** np.arange(1.0, -math.log2(SMALLEST), 0.5)
    distance = np.concatenate([-distance, [0.0], distance])
    more = (centres[:, None] + distance).ravel()
    return np.asarray(np.unique(np.concatenate([samples, more[(more >= 0.0) & (more <= 1.0)]])))


def _zeros(node: ast.expr, way: Way, fractions: Array, values: Array) -> Array:
    """Return where a sub-expression vanishes.

    These are samples at which it is 0 (ends of runs of them), and bisected changes of sign.
    """
    zero: Mask = values == 0.0
    edges = zero & ~(np.append(zero[1:], False) & np.insert(zero[:-1], 0, False))
    sign = np.sign(values)
    cut = np.flatnonzero(sign[1:] * sign[:-1] < 0.0)
    low, high, below = fractions[cut], fractions[cut + 1], sign[cut]
    if len(cut) > MOST_FEATURES:
        return fractions[edges]  # rough everywhere: the samples show that

    def same(points: Array) -> Mask:
        found = plain_value(node, way(points.ravel()).names, points.size)
        return np.asarray(np.sign(found.reshape(points.shape)) == below)

    return np.concatenate([fractions[edges], _changes(same, low, high)])


def _changes(same: Callable[[Array], Mask], low: Array, high: Array) -> Array:
    """Return the fractions (c,) at which some functions change, each between two bounds (c,).

    `same` says at which of some fractions (k, c) they are as at the lower bounds. Each round cuts
    an interval into `PARTS` parts: one call for three bisections.
    """
    for _ in range(ROUNDS if len(low) else 0):
        step = (high - low) / PARTS
        stays = same(low + step * np.arange(1, PARTS)[:, None])
        passed = np.logical_and.accumulate(stays, axis=0).sum(axis=0)
        low = low + passed * step
        high = np.where(stays.all(axis=0), high, low + step)
    return high


def _turns(fractions: Array, values: Array) -> Array:
    """Return the samples at which a sub-expression has an extremum above its round-off."""
    least = ROUNDED * np.minimum(np.abs(values[1:]), np.abs(values[:-1]))
    with np.errstate(invalid="ignore"):  # differences of infinite values
        rise = (values[1:] > values[:-1] + least) * 1 - (values[1:] < values[:-1] - least)
    moves = np.flatnonzero(rise)
    return np.asarray(fractions[moves[1:]][rise[moves[1:]] * rise[moves[:-1]] < 0.0])
