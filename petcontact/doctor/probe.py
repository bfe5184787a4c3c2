"""Facts about this installation as JSON; `petcontact doctor` runs it as a process of its own, which
may crash."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

from ..untyped import Keyed


def libraries(pattern: str) -> list[str]:
    """Shared libraries of this process whose file name begins with a pattern, links followed."""
    maps = Path("/proc/self/maps")
    if not maps.exists():
        return []
    words = [
        line.split(maxsplit=5)[-1].strip()
        for line in maps.read_text().splitlines()
        if ".so" in line
    ]
    return sorted({os.path.realpath(word) for word in words if Path(word).name.startswith(pattern)})


def petsc_facts() -> Keyed:
    """PETSc, petsc4py and MPI as they are when loaded together with numpy."""
    import petsc4py

    petsc4py.init(["doctor", "-options_left", "no"])
    import numpy as np
    from mpi4py import MPI
    from petsc4py import PETSc

    packages = [
        name for name in ("mumps", "superlu_dist", "hdf5") if PETSc.Sys.hasExternalPackage(name)
    ]
    return {
        "petsc4py": petsc4py.__version__,
        "petsc": ".".join(str(k) for k in PETSc.Sys.getVersion()),
        "petsc_dir": petsc4py.get_config().get("PETSC_DIR", ""),
        "scalar": np.dtype(PETSc.ScalarType).name,
        "integer": np.dtype(PETSc.IntType).name,
        "packages": packages,
        "mpi": " ".join(
            MPI.Get_library_version().splitlines()[0].split(",")[0].strip("\x00 ").split()
        ),
        "mpi_libraries": libraries("libmpi.") + libraries("libmpi_abi") + libraries("libmpich"),
    }


def blas_facts() -> Keyed:
    """BLAS libraries in use and their threads."""
    import numpy as np
    import threadpoolctl  # type: ignore[import-untyped,unused-ignore]

    np.ones((2, 2)) @ np.ones((2, 2))
    pools = [pool for pool in threadpoolctl.threadpool_info() if pool.get("user_api") == "blas"]
    return {
        "blas": [
            [pool["internal_api"], str(pool.get("version")), pool["num_threads"]] for pool in pools
        ]
    }


def hdf5_facts() -> Keyed:
    """h5py, its HDF5, and whether that is the parallel flavour."""
    import h5py

    return {
        "h5py": h5py.__version__,
        "hdf5": h5py.version.hdf5_version,
        "hdf5_mpi": bool(h5py.get_config().mpi),
        "hdf5_libraries": libraries("libhdf5"),
    }


def plot_facts() -> Keyed:
    """matplotlib, the font that figures use, and the backend."""
    import matplotlib
    from matplotlib import font_manager

    try:
        font = font_manager.findfont("DejaVu Sans", fallback_to_default=False)
    except ValueError:
        font = ""
    return {
        "matplotlib": matplotlib.__version__,
        "font": font,
        "config_dir": matplotlib.get_configdir(),
    }


PARTS = {"petsc": petsc_facts, "blas": blas_facts, "hdf5": hdf5_facts, "plot": plot_facts}


def main(names: list[str]) -> None:
    """Print the facts of the parts named, and why a part has none."""
    facts: Keyed = {"errors": {}}
    for name in names:
        try:
            facts |= PARTS[name]()
        except Exception as error:  # whatever a broken installation raises is reported
            facts["errors"][name] = f"{type(error).__name__}: {' '.join(str(error).split())}"
    print(json.dumps(facts))


if __name__ == "__main__":
    main(sys.argv[1:])
