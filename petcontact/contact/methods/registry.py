"""The methods by name. A new one is a file here with `build`, and its line in `model.solver_options.METHODS`."""

from __future__ import annotations

import importlib

from ...model.solver_options import METHODS, Method
from ..iteration import ContactMethod
from ..rho_rules import Rule


def method_of(options: Method, rule: Rule | None = None) -> ContactMethod:
    """The method that a `[method]` table describes, its parameters filled in.

    Parameters
    ----------
    options : Method
    rule : Rule, optional
        A rule of the user's own, which chooses the projection method.
    """
    name = "projection" if rule is not None else options.resolved_name
    method: ContactMethod = importlib.import_module(f".{METHODS[name]}", __package__).build(options, rule)
    return method
