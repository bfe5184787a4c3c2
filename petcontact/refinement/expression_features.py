"""Where an expression may be rough or narrow, read off its syntax tree.

Samples of a function never show a peak that is narrower than their spacing. The text of the
function does: what is small or singular somewhere has a sub-expression that vanishes there, as x -
3 does in exp(-((x - 3)/1e-6)**2).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator

import numpy as np

from ..arrays import Array, Mask
from ..frozen import frozen
from ..model.expressions import Value, parse_expression, plain_value

_SMOOTH_AT_ZERO = frozenset({"sin", "cos", "tan", "atan", "sinh", "cosh", "tanh", "exp"})
"""Functions of one value that are smooth where it vanishes (tan and those that are not elsewhere:
at their poles only)."""
_AT_ONE = frozenset({"asin", "acos"})
SAMPLES = 4096
"""Uniform samples of a side."""
HALVINGS = 79
"""Samples on either side of a centre: at the distances 2^(-j/2), j = 2 ... HALVINGS, of the side's
length."""
MOST_CENTRES = 64
"""Places at which one sub-expression vanishes or turns that get samples of their own."""
BISECTIONS = 60
CONSTANT = frozenset({"pi", "e", "nx", "ny"})
"""Names that stand for one number on a straight line."""

Variables = Callable[[Array], dict[str, Array]]


@frozen
class Features:
    """What one expression shows on one side, as fractions of the side.

    Attributes
    ----------
    switches : (k,) array
        Places inside the side at which the expression may have a kink or a jump, increasing.
    samples : (n,) array
        Fractions in [0, 1], increasing, dense around whatever may be narrow.
    """

    switches: Array
    samples: Array


def features(text: str, variables: Variables) -> Features:
    """Switches of an expression on a side, and samples that miss no peak of it.

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
    samples = uniform()
    for end in (0.0, 1.0):
        samples = _around(np.array([end]), samples)
    switches: list[Array] = []
    for node, switch in _parts(parse_expression(text)):
        values = _values(node, variables, samples)
        if np.all(values == values[0]):
            continue
        zeros = _zeros(node, variables, samples, values)
        centres = np.concatenate([zeros, _turns(samples, values)])
        if len(zeros) and switch:
            switches.append(zeros)
        if len(centres):
            samples = _around(centres[:: max(1, len(centres) // MOST_CENTRES)], samples)
    found = np.unique(np.concatenate(switches)) if switches else np.empty(0)
    return Features(_distinct(found[(found > 0.0) & (found < 1.0)]), samples)


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


def _parts(tree: ast.expr) -> Iterator[tuple[ast.expr, bool]]:
    """Sub-expressions that may vanish, inner ones first, and whether the whole has a kink or a jump
    where they do."""
    for node in reversed(list(ast.walk(tree))):
        if isinstance(node, ast.Compare):
            yield _difference(node.left, node.comparators[0]), True
        elif isinstance(node, ast.BinOp):
            if isinstance(node.op, (ast.Add, ast.Sub)):
                yield node, False
            elif isinstance(node.op, ast.Div):
                yield node.right, True
            elif isinstance(node.op, ast.Mod):
                yield _wave(ast.BinOp(node.left, ast.Div(), node.right)), True
            elif isinstance(node.op, ast.Pow) and not _is_whole(node.right):
                yield node.left, True
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield from _of_call(node.func.id, node.args)


def _of_call(name: str, arguments: list[ast.expr]) -> Iterator[tuple[ast.expr, bool]]:
    if name in ("min", "max"):
        yield _difference(*arguments), True
    elif name in ("floor", "ceil"):
        yield _wave(arguments[0]), True
    elif name in _AT_ONE:
        for sign in (1.0, -1.0):
            yield _difference(arguments[0], ast.Constant(sign)), True
    elif name == "tan":
        yield ast.Call(ast.Name("cos", ast.Load()), arguments, []), True
    elif name not in _SMOOTH_AT_ZERO:
        for argument in arguments:
            yield argument, True


def _difference(left: ast.expr, right: ast.expr) -> ast.expr:
    return ast.BinOp(left, ast.Sub(), right)


def _wave(argument: ast.expr) -> ast.expr:
    """sin(π a), which vanishes where a is a whole number."""
    turns = ast.BinOp(ast.Name("pi", ast.Load()), ast.Mult(), argument)
    return ast.Call(ast.Name("sin", ast.Load()), [turns], [])


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
    """Samples at which a sub-expression has a maximum or a minimum."""
    rise = np.sign(np.diff(values))
    return np.asarray(at[1:-1][rise[1:] * rise[:-1] < 0.0])


def _distinct(places: Array) -> Array:
    """Increasing places without those that are the one before, to round-off."""
    return places[np.append(True, np.diff(places) > 1e-13)] if len(places) else places
