"""petcontact: PETSc-backed boundary elements for frictional contact of elastic bodies."""

from __future__ import annotations

from typing import Any

import lazy_loader

__version__ = "0.2.0"

RENAMED = {
    "Assembly": "Problem",
    "AssemblySolution": "Solution",
    "Case": "Problem",
    "adapt_assembly": "adapt",
    "load_any": "load",
    "load_assembly": "load",
    "solve_assembly": "solve",
}
"""Names of before and what they are now; they go with the next release."""

# The public names and their types stand in __init__.pyi; each is imported when first used, so that
# `petcontact --help` works without PETSc and starts at once.
_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name in RENAMED:
        import warnings

        warnings.warn(
            f"petcontact.{name} is petcontact.{RENAMED[name]} now", DeprecationWarning, stacklevel=2
        )
    return _attribute(RENAMED.get(name, name))
