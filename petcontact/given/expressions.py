"""Expressions of a config: parsed into trees that hold arithmetic only, and evaluated by
simpleeval: no names but ours, no attributes, no loops."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Callable, Mapping

import numpy as np
import simpleeval

from ..arrays import Array
from ..errors import InputError
from ..runtime.hints import number_refused

ARITHMETIC = (
    "only numbers, names, arithmetic, comparisons and functions are allowed, as where(x > 0, 1, 2)"
)
PRODUCT = "cannot be read; a product needs its sign, as in 10*x"
FUNCTIONS: dict[str, tuple[Callable[..., object], int]] = {
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "asin": (np.arcsin, 1),
    "acos": (np.arccos, 1),
    "atan": (np.arctan, 1),
    "atan2": (np.arctan2, 2),
    "sinh": (np.sinh, 1),
    "cosh": (np.cosh, 1),
    "tanh": (np.tanh, 1),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "hypot": (np.hypot, 2),
    "sign": (np.sign, 1),
    "floor": (np.floor, 1),
    "ceil": (np.ceil, 1),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "where": (lambda condition, yes, no: np.where(condition != 0.0, yes, no), 3),
}
_CALLED = {name: function for name, (function, _) in FUNCTIONS.items()}
# floats throughout: Python's unbounded integers would let 9**9**9 run for ever
_OPERATORS: dict[type[ast.AST], Callable[..., object]] = {
    ast.Add: lambda a, b: np.add(_real(a), _real(b)),
    ast.Sub: lambda a, b: np.subtract(_real(a), _real(b)),
    ast.Mult: lambda a, b: np.multiply(_real(a), _real(b)),
    ast.Div: lambda a, b: np.divide(_real(a), _real(b)),
    ast.Mod: lambda a, b: np.mod(_real(a), _real(b)),
    ast.Pow: lambda a, b: np.power(_real(a), _real(b)),
    ast.USub: lambda a: np.negative(_real(a)),
    ast.UAdd: lambda a: _real(a),
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}


# Arrays have methods that write files, and numpy's functions an `out` that writes over mesh
# coordinates: what is not listed here (attributes, subscripts, keywords, text, names of Python) is
# refused before anything is evaluated.
_ALLOWED = (
    ast.Expression,
    ast.BinOp,
    ast.UnaryOp,
    ast.Compare,
    ast.Call,
    ast.Name,
    ast.Load,
    ast.Constant,
    *_OPERATORS,
)


def _real(value: object) -> Array:
    return np.asarray(value, dtype=float)


def _reason(text: str, error: Exception) -> str:
    """Why a text is no expression, and what is most often meant."""
    if refused := number_refused(text):
        return refused
    if re.search(r"\d\s*[a-z(]|\)\s*[\w(]", text):
        return PRODUCT
    if re.search(r"\|[^|]+\|", text):
        return "a size is written abs(x)"
    return f"cannot be read ({getattr(error, 'msg', None) or str(error) or 'nested too deeply'})"


@functools.lru_cache(maxsize=1024)
def parse_expression(text: str) -> ast.expr:
    """The syntax tree of an expression that holds nothing but arithmetic; one tree a text, not to
    be changed.

    Raises
    ------
    InputError
        If it holds anything else, or cannot be read.
    """
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        raise InputError(_reason(text, error)) from None
    for node in ast.walk(tree):
        _check(node)
        if isinstance(node, ast.Call):
            _check_call(node)
    return tree.body


def _check(node: ast.AST) -> None:
    """Refuse a node of a syntax tree that is no arithmetic."""
    if isinstance(node, ast.BitXor):
        raise InputError("a power is written with **, as in x**2")
    plain_number = not isinstance(node, ast.Constant) or type(node.value) in (int, float)
    if not isinstance(node, _ALLOWED) or not plain_number:
        raise InputError(ARITHMETIC)
    if isinstance(node, ast.Compare) and len(node.ops) > 1:
        raise InputError("chained comparisons are not allowed, write (a < x) * (x < b)")


def _check_call(node: ast.Call) -> None:
    """Refuse a call with keywords, of a number, or of a function that takes other values."""
    if node.keywords:
        raise InputError(ARITHMETIC)
    if isinstance(node.func, ast.Constant | ast.BinOp):
        raise InputError(PRODUCT)
    name = node.func.id if isinstance(node.func, ast.Name) else "?"
    count = FUNCTIONS[name][1] if name in FUNCTIONS else len(node.args)
    if len(node.args) != count:
        raise InputError(
            f"{name} takes {count} value{'s' if count > 1 else ''}, got {len(node.args)}"
        )


def plain_value(tree: ast.expr, variables: Mapping[str, Array], count: int) -> Array:
    """Values (count,) of a syntax tree from `parse_expression`, finite or not; mistakes are
    simpleeval's."""
    evaluator = _evaluator()
    evaluator.names = {**variables, "pi": np.pi, "e": np.e}
    with np.errstate(all="ignore"):
        value: Array = np.broadcast_to(
            _real(evaluator.eval("", previously_parsed=tree)), (count,)
        ).astype(float)
    return value


@functools.cache
def _evaluator() -> simpleeval.SimpleEval:
    return simpleeval.SimpleEval(operators=_OPERATORS, functions=_CALLED)


def shown(text: str) -> str:
    """A text in quotes, at most 60 characters of it."""
    quoted = ascii(text) if not text.isprintable() else repr(text)
    return quoted if len(quoted) <= 60 else f"{quoted[:57]}..."
