"""Boundary data given as expressions, evaluated at nodes by simpleeval: no names but ours, no
attributes, no loops."""

from __future__ import annotations

import ast
import functools
import inspect
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import simpleeval

from ..arrays import LARGEST_NUMBER, Array
from ..errors import InputError
from .hints import number_refused

PRODUCT = "cannot be read; a product needs its sign, as in 10*x"
_FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {
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
_CALLED = {name: function for name, (function, _) in _FUNCTIONS.items()}
# floats throughout: Python's unbounded integers would let 9**9**9 run for ever
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
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


def _real(value: Any) -> Array:
    return np.asarray(value, dtype=float)


def _reason(text: str, error: Exception) -> str:
    """Why a text is no expression, and what is most often meant."""
    if refused := number_refused(text):
        return refused
    if re.search(r"\d\s*[a-z(]|\)\s*[\w(]", text):
        return PRODUCT
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
        if isinstance(node, ast.BitXor):
            raise InputError("a power is written with **, as in x**2")
        plain_number = not isinstance(node, ast.Constant) or type(node.value) in (int, float)
        if (
            not isinstance(node, _ALLOWED)
            or not plain_number
            or (isinstance(node, ast.Call) and node.keywords)
        ):
            raise InputError(
                "only numbers, names, arithmetic, comparisons and functions are allowed, as "
                "where(x > 0, 1, 2)"
            )
        if isinstance(node, ast.Compare) and len(node.ops) > 1:
            raise InputError("chained comparisons are not allowed, write (a < x) * (x < b)")
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Constant | ast.BinOp):
                raise InputError(PRODUCT)
            name = node.func.id if isinstance(node.func, ast.Name) else "?"
            if name in _FUNCTIONS and len(node.args) != _FUNCTIONS[name][1]:
                count = _FUNCTIONS[name][1]
                raise InputError(
                    f"{name} takes {count} value{'s' if count > 1 else ''}, got {len(node.args)}"
                )
    return tree.body


Value = float | str | tuple[float, ...] | Callable[..., Any]


def evaluate(
    value: Value,
    variables: Mapping[str, Array],
    count: int,
    key: str,
    *,
    otherwise: float | None = None,
) -> Array:
    """Values (count,) of a number, an expression, a function or an array at nodes.

    Parameters
    ----------
    value : float, str, callable or (count,) values
        A number; an expression in the variables with the usual functions (sin, exp, sqrt, where,
        min, ...); a function whose parameters are some of the variables by name; or a value a node.
    variables : mapping of str to (count,) arrays
        x, y, nx, ny [-] and s, the arc length along the part.
    count : int
        Number of nodes.
    key : str
        The key of the config that the value comes from, named in errors.
    otherwise : float, optional
        What stands in the place of values that are not finite, or beyond the largest number;
        without it they are mistakes.

    Raises
    ------
    InputError
        If the expression cannot be read, uses an unknown name, or is not finite somewhere; or if
        there are not as many values as nodes.
    """
    if callable(value):
        return _called(value, variables, count, key, otherwise)
    if isinstance(value, tuple):
        if len(value) != count:
            raise InputError(f"{key}: has {len(value)} values, the part has {count} nodes")
        return np.array(value)
    if not isinstance(value, str):
        return np.full(count, float(value))
    try:
        result = plain_value(parse_expression(value), variables, count)
    except (simpleeval.NameNotDefined, simpleeval.FunctionNotDefined) as error:
        name = str(getattr(error, "name", None) or getattr(error, "func_name", "?"))
        if name == "free":
            raise InputError(
                f'{key}: only a displacement can be "free"; a free component of a traction is 0.0'
            ) from None
        text = f"{key}: unknown name {_shown(name)} in expression {_shown(value)}"
        raise InputError(f"{text}; {_allowed(variables, name)}") from None
    except (
        Exception
    ) as error:  # whatever a stranger's text does inside the evaluator is a mistake of the input
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"{key}: cannot evaluate expression {_shown(value)} ({reason}); {_allowed(variables)}"
        ) from None
    return _finite(result, variables, f"{key}: expression {_shown(value)}", otherwise)


def _allowed(variables: Mapping[str, Array], name: str = "") -> str:
    if name == "z":
        return "z is known in 3D only, 2D has x and y"
    return f"allowed are {', '.join(variables)}, pi, e and {', '.join(sorted(_FUNCTIONS))}"


def _called(
    function: Callable[..., Any],
    variables: Mapping[str, Array],
    count: int,
    key: str,
    otherwise: float | None,
) -> Array:
    """Values (count,) of a function of some variables."""
    names = list(inspect.signature(function).parameters)
    name = f"{key}: function {getattr(function, '__name__', type(function).__name__)}"
    unknown = [variable for variable in names if variable not in variables]
    if unknown:
        raise InputError(
            f"{name} has a parameter {unknown[0]!r}; allowed are {', '.join(variables)}"
        )
    try:
        result = np.asarray(function(**{variable: variables[variable] for variable in names}))
    except Exception as error:
        raise InputError(f"{name} fails with {type(error).__name__}: {error}") from error
    try:
        values = result.astype(float, casting="unsafe" if result.dtype == object else "same_kind")
    except (TypeError, ValueError):
        raise InputError(
            f"{name} returns values of type {result.dtype}, expected real numbers"
        ) from None
    if values.shape not in ((), (count,)):
        raise InputError(
            f"{name} returns an array of shape {values.shape}, expected ({count},) or a number"
        )
    values = np.broadcast_to(values, (count,)).copy()
    return _finite(values, variables, name, otherwise)


def _finite(
    values: Array, variables: Mapping[str, Array], what: str, otherwise: float | None
) -> Array:
    if otherwise is not None:
        return np.where(np.abs(values) <= LARGEST_NUMBER, values, otherwise)
    if not np.all(np.isfinite(values)):
        k = int(np.argmin(np.isfinite(values)))
        place = ", ".join(
            f"{name} = {variables[name][k]:g}" for name in ("x", "y", "z") if name in variables
        )
        raise InputError(f"{what} is not finite at {place}")
    if np.abs(values).max(initial=0.0) > LARGEST_NUMBER:
        largest = values[np.argmax(np.abs(values))]
        raise InputError(
            f"{what} reaches {largest:g}; allowed are values from {-LARGEST_NUMBER:g} to "
            f"{LARGEST_NUMBER:g}"
        )
    return values


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


def _shown(text: str) -> str:
    shown = ascii(text) if not text.isprintable() else repr(text)
    return shown if len(shown) <= 60 else f"{shown[:57]}..."
