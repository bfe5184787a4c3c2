"""Methods and laws from names, from classes of the package, or from the user's objects.

A method of the package is a file here with `build`, and a line in `METHODS` of
`given.tables.solver_options`.
"""

from __future__ import annotations

import copy
import importlib
from collections.abc import Mapping
from typing import cast

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...given.tables.solver_options import METHODS, Method
from ...record import record
from ...runtime.ranks import answered, is_shared
from .. import laws
from ..iteration import ContactMethod
from ..law_protocol import ContactLaw, GivenLaw
from ..rho_rules import Rule, rule_of

GivenMethod = Method | str | type | ContactMethod
"""A `[method]` table, a name, a class of petcontact, or any `method(system, law, iteration)`."""
LAW_MEMBERS = ("k", "groups", "project", "linearise", "states")


def method_of(
    method: GivenMethod,
    rule: Rule | str | type | None = None,
    options: Method | None = None,
) -> ContactMethod:
    """Return a method with its parameters.

    Parameters
    ----------
    method : Method, str, class or callable
        A `[method]` table; a key of METHODS or a class of the package, with the parameters of
        `options`; or a method of the user, `method(system, law, iteration) -> ContactState`.
    rule : Rule, str or class, optional
        A rule for ρ, a key of RULES, or a class. It replaces the rule of the table, and chooses the
        projection method of a table.
    options : Method, optional
        The table with the parameters for a name or a class.

    Raises
    ------
    InputError
        If it is none of these, or a rule is given beside a method that has none. In a table it is
        one of the keys that a method does not read (`Method.ignored`), which commands name.

    Examples
    --------
    >>> method_of("operator-robin")
    OperatorRobin(omega=1.8)
    >>> method_of(Method(rule="fixed", rho=3.0)).rho
    3.0
    """
    options = options if options is not None else Method()
    if isinstance(method, type):
        modules = {f"{__package__}.{module}": name for name, module in METHODS.items()}
        method = modules.get(method.__module__, method)
    if isinstance(method, type):
        raise InputError(
            f"method: {method.__name__} is a class; give an object of it, {method.__name__}(...)"
        )
    if isinstance(method, str):
        given = options.model_dump(exclude_unset=True, exclude={"name"})
        method = Method(**{**given, "name": method})
        if rule is not None and method.name != "projection":
            raise InputError(f"rule: {method.name} has no ρ that changes; projection has")
    if isinstance(method, Method):
        name = "projection" if rule is not None else method.resolved_name
        return cast(
            ContactMethod,
            importlib.import_module(f".{METHODS[name]}", __package__).build(
                method, rule_of(rule, method)
            ),
        )
    if not callable(method):
        raise InputError(
            f"method: a name ({', '.join(METHODS)}), a class of petcontact.contact.methods, or a "
            f"callable (system, law, iteration) -> ContactState; got {method!r}"
        )
    if rule is not None:
        raise InputError("rule: a method of one's own has its own; give it there")
    return method


@record
class ContactNodes:
    """All contact nodes of a problem, for a function that makes a law.

    Attributes
    ----------
    x, normal : (m, d) arrays
        Positions [length]; normals from the secondary to the primary.
    weight : (m,) array
        Quadrature weights [length or area].
    pairs : mapping of str to slice
        The nodes of each pair by its name.
    law : ContactLaw
        The law of the problem itself.
    """

    x: Array
    normal: Array
    weight: Array
    pairs: Mapping[str, slice]
    law: ContactLaw


def law_of(law: GivenLaw | None, nodes: ContactNodes) -> ContactLaw:
    """Return the law: that of the problem, the user's object, or the result of a function of the
    nodes.

    Raises
    ------
    InputError
        If it lacks a member of `ContactLaw`, or does not fit the nodes or the number of components.
    """
    if law is None:
        return nodes.law
    checked = made_law(law, nodes)
    shape = len(nodes.weight), nodes.law.k
    if checked.k != nodes.law.k:
        raise InputError(
            f"law: {type(checked).__name__} has k = {checked.k}; this contact has {nodes.law.k} "
            f"components a node"
        )
    try:
        fits = np.shape(checked.project(np.zeros(shape))) == shape
    except ValueError:
        fits = False
    if not fits:
        raise InputError(
            f"law: {type(checked).__name__} does not project tractions of shape {shape}, m nodes "
            "of k components"
        )
    own = type(checked).__module__ != laws.__name__
    return _answering_first(checked) if own and is_shared() else checked


def made_law(law: GivenLaw, nodes: ContactNodes) -> ContactLaw:
    """Return the user's law, or the result of a function of the nodes.

    Raises
    ------
    InputError
        If it lacks a member of `ContactLaw`.
    """
    missing = [name for name in LAW_MEMBERS if not hasattr(law, name)]
    if callable(law) and len(missing) == len(LAW_MEMBERS):
        law = law(nodes)
        missing = [name for name in LAW_MEMBERS if not hasattr(law, name)]
    if missing:
        raise InputError(
            f"law: {type(law).__name__} has no {', '.join(missing)}; a law has "
            f"{', '.join(LAW_MEMBERS)}"
        )
    return cast(ContactLaw, law)


def _answering_first(law: ContactLaw) -> ContactLaw:
    """Return a copy of a user's law whose answers are those of the first rank."""
    kind = type(law)
    members = {name: answered(getattr(kind, name)) for name in LAW_MEMBERS[2:]}
    copied = copy.copy(law)
    twin = type(kind.__name__, (kind,), {"__slots__": (), **members})
    object.__setattr__(copied, "__class__", twin)
    return copied
