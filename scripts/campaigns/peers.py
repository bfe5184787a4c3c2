"""What scripts compare petcontact with, where it is installed."""

import importlib.util
import sys
from pathlib import Path


def need_scikit_fem(way_out: str) -> None:
    """End a script that compares with scikit-fem where that is not installed; `way_out`: the option
    that leaves it out."""
    if importlib.util.find_spec("skfem") is None:
        name = Path(sys.argv[0]).name
        sys.exit(
            f"{name}: needs scikit-fem, which scripts/setup --benchmark installs; {way_out} "
            "leaves it out"
        )
