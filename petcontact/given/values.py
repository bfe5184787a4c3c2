"""`Given`: one function of the place for each datum of a problem, and its kinds.

A kind is a class with `values`, and a line that says from which type of Python it is made:
`as_given.register`. Nothing else in the package asks of which kind a datum is.
"""

from __future__ import annotations

import abc
import functools
import inspect
import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import simpleeval

from ..arrays import LARGEST_NUMBER, Array
from ..errors import InputError
from ..geometry.noise import Noise
from ..record import field, record
from ..runtime.hints import nearest
from .expressions import FUNCTIONS, parse_expression, plain_value, shown
from .features import degree, features_of, uniform
from .sites import Sites, Way


@record
class Given(abc.ABC):
    """A datum of a problem as a function of the place.

    Attributes
    ----------
    key : str
        Place in the config, which errors name. Data are equal where their sources are.
    source : Any
        What the config or the caller of Python gave.
    varies : bool
        Whether the values may differ from place to place.
    everywhere : bool
        Whether the values are known at all places; else only at the nodes of one mesh.
    rough : bool
        Whether they may have kinks and jumps along a line.
    """

    key: str = field(compare=False)
    source: Any
    varies: ClassVar[bool] = True
    everywhere: ClassVar[bool] = True
    rough: ClassVar[bool] = True

    @abc.abstractmethod
    def values(self, sites: Sites) -> Array:
        """Return the values (n,) at sites, finite or not.

        Raises
        ------
        InputError
            If they cannot be evaluated: one line that names the key.
        """

    def at(self, sites: Sites) -> Array:
        """Return the values (n,) at sites.

        Raises
        ------
        InputError
            If a value cannot be evaluated, is not finite or exceeds the largest number.
        """
        values = self.values(sites)
        if not np.all(np.isfinite(values)):
            k = int(np.argmin(np.isfinite(values)))
            place = ", ".join(f"{c} = {x:g}" for c, x in zip("xyz", sites.x[k], strict=False))
            raise InputError(f"{self.words} is not finite at {place}")
        if np.abs(values).max(initial=0.0) > LARGEST_NUMBER:
            largest = values[np.argmax(np.abs(values))]
            raise InputError(
                f"{self.words} reaches {largest:g}; allowed are values from {-LARGEST_NUMBER:g} "
                f"to {LARGEST_NUMBER:g}"
            )
        return values

    def near(self, sites: Sites, otherwise: float = 0.0) -> Array:
        """Return the values (n,) at sites, and another one where they are not finite or exceed
        the largest number."""
        values = self.values(sites)
        return np.where(np.abs(values) <= LARGEST_NUMBER, values, otherwise)

    @property
    def is_zero(self) -> bool:
        """Whether it is the number 0."""
        return not self.varies and self.source == 0.0

    @property
    def degree(self) -> float:
        """Degree as a polynomial on a straight line, infinite for all other functions."""
        return math.inf

    def features(self, way: Way) -> tuple[Array, Array]:
        """Return fractions (k,) of a line at which the values may be narrow, and increasing ones
        (n,) between which they are resolved."""
        return np.empty(0), uniform()

    def noise_at(self, x: Array, reach: float) -> Noise:
        """Return what the noise of measured values does to the mean curvature so far on either
        side of a place (d,)."""
        return Noise()

    @property
    def words(self) -> str:
        """The key and the kind, as errors name them."""
        return self.key

    def __str__(self) -> str:
        return str(self.source)


@functools.singledispatch
def as_given(source: object, key: str) -> Given:
    """Return the datum that a number, an expression, a function or an array of nodal values is.

    Parameters
    ----------
    source : float, str, callable or tuple
        As the config or the caller of Python gave it.
    key : str
        Its place in the config, which errors name.

    Examples
    --------
    >>> import numpy as np
    >>> line = Sites(np.array([[0.0, 1.0], [2.0, 1.0]]))
    >>> [as_given(source, "gap").at(line).tolist() for source in (3.0, "x**2 + y", lambda x: 2 * x)]
    [[3.0, 3.0], [1.0, 5.0], [0.0, 4.0]]
    >>> as_given("1/x", "gap").near(line, np.inf).tolist()
    [inf, 0.5]
    >>> as_given("1/x", "gap").at(line)
    Traceback (most recent call last):
    petcontact.errors.InputError: gap: expression '1/x' is not finite at x = 0, y = 1
    """
    return Function(key, source)


class Number(Given):
    """The same value everywhere."""

    varies = False

    def values(self, sites: Sites) -> Array:
        return np.full(len(sites), float(self.source))

    @property
    def degree(self) -> float:
        return 0.0


class Expression(Given):
    """A text in the names of `Sites`, see `expressions`."""

    def values(self, sites: Sites) -> Array:
        try:
            return plain_value(parse_expression(self.source), sites.names, len(sites))
        except simpleeval.NameNotDefined as error:
            raise InputError(self._unknown(error.name, [*sites.names, "free"], sites)) from None
        except simpleeval.FunctionNotDefined as error:
            raise InputError(self._unknown(error.func_name, [*FUNCTIONS], sites)) from None
        except Exception as error:
            # whatever a text does inside the evaluator is a mistake of the input
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"{self.key}: cannot evaluate expression {shown(self.source)} ({reason}); "
                f"{_allowed(sites)}"
            ) from None

    def _unknown(self, name: str, alike: Sequence[str], sites: Sites) -> str:
        if name == "free":
            return (
                f'{self.key}: only a displacement can be "free"; a free component of a traction '
                "is 0.0"
            )
        allowed = "z is known in 3D only, 2D has x and y" if name == "z" else _allowed(sites)
        hint = nearest(name, alike) or f"; {allowed}"
        return f"{self.key}: unknown name {shown(name)} in expression {shown(self.source)}{hint}"

    @property
    def degree(self) -> float:
        return degree(self.source)

    def features(self, way: Way) -> tuple[Array, Array]:
        return features_of(self.source, way)

    @property
    def words(self) -> str:
        return f"{self.key}: expression {shown(self.source)}"


class Function(Given):
    """A function of Python whose parameters are some of the names of `Sites`; others have a
    default, which they keep.

    >>> import numpy as np
    >>> steep = Function("gap", lambda x, slope=2.0: slope * x)
    >>> steep.at(Sites(np.array([[3.0, 0.0]]))).tolist()
    [6.0]
    """

    def values(self, sites: Sites) -> Array:
        known = sites.names
        parameters = inspect.signature(self.source).parameters.values()
        # others keep their defaults, as of lambda x, spline=spline: spline(x)
        names = [p.name for p in parameters if p.default is p.empty or p.name in known]
        unknown = [name for name in names if name not in known]
        if unknown:
            raise InputError(
                f"{self.words} has a parameter {unknown[0]!r}; allowed are {', '.join(known)}"
            )
        try:
            result = np.asarray(self.source(**{name: known[name] for name in names}))
        except Exception as error:
            raise InputError(f"{self.words} fails with {type(error).__name__}: {error}") from error
        rule = "unsafe" if result.dtype == object else "same_kind"
        try:
            values = result.astype(float, casting=rule)  # type: ignore[call-overload]
        except (TypeError, ValueError):
            raise InputError(
                f"{self.words} returns values of type {result.dtype}, expected real numbers"
            ) from None
        if values.shape not in ((), (len(sites),)):
            raise InputError(
                f"{self.words} returns an array of shape {values.shape}, expected ({len(sites)},) "
                "or a number"
            )
        return np.broadcast_to(values, (len(sites),)).copy()

    @property
    def words(self) -> str:
        name = getattr(self.source, "__name__", type(self.source).__name__)
        return f"{self.key}: function {name}"


class Nodal(Given):
    """One value for each node of the part on one mesh."""

    everywhere = False

    def values(self, sites: Sites) -> Array:
        if len(self.source) != len(sites):
            raise InputError(
                f"{self.key}: has {len(self.source)} values, the part has {len(sites)} nodes; "
                "an array is one value a node, a number or an expression holds everywhere"
            )
        return np.array(self.source)


as_given.register(float, lambda source, key: Number(key, source))
as_given.register(int, lambda source, key: Number(key, float(source)))
as_given.register(str, lambda source, key: Expression(key, source))
as_given.register(tuple, lambda source, key: Nodal(key, source))


def _allowed(sites: Sites) -> str:
    return f"allowed are {', '.join(sites.names)}, pi, e and {', '.join(sorted(FUNCTIONS))}"
