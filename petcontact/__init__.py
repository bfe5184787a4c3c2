"""petcontact: PETSc-backed boundary elements for frictional contact of elastic bodies."""

from __future__ import annotations

import lazy_loader

__version__ = "0.2.0"

# The public names and their types stand in __init__.pyi; each is imported when first used, so that
# `petcontact --help` works without PETSc and starts at once.
_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    if name in __all__ or name.startswith("_"):
        return _attribute(name)
    from .runtime.hints import nearest  # of names that are wrong only: what starts is to start soon

    raise AttributeError(f"petcontact has no {name!r}{nearest(name, __all__)}", name=name)
