"""Result files: HDF5 that h5py alone can read, written whole or not at all."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..contact.state import COLUMNS, History
from ..errors import PetcontactError, ResultError
from ..mesh.storage import read_mesh, write_mesh
from ..model.base import parse
from ..model.case import Case
from ..model.units import Units
from ..refinement.zones import Zone
from ..runtime.atomic_write import temporary_name
from .checks import check_contact, check_fields, check_group, check_history, check_link, read_table
from .solution import ContactFields, Solution
from .steps.solution import AssemblySolution

FORMAT = "petcontact result"
FORMAT_VERSION = 1
SEAL = b"\npetcontact sha256\n"
"""What stands after the HDF5 file, which does not mind, before the hash of its bytes: HDF5 may crash on damaged ones."""
PROVENANCE = ("argv", "petsc_options", "versions")
"""Entries of `info` that are attributes of their own as well."""
DESCRIPTIONS = {
    "boundary/x": ("length", "nodes"),
    "boundary/normal": ("1", "outward unit normals"),
    "boundary/weight": ("length", "quadrature weights: the sum of weight * f(x) is the integral of f"),
    "boundary/u": ("length", "displacement"),
    "boundary/traction": ("stress", "traction on the body"),
    "boundary/part": ("1", "name of the part of each node"),
    "contact/nodes": ("1", "numbers of the contact nodes among those of /boundary"),
    "contact/x": ("length", "contact nodes"),
    "contact/tangent": ("1", "tangents; in the plane the outward normal turned by +90 degrees"),
    "contact/weight": ("length", "quadrature weights"),
    "contact/arc_length": ("length", "arc length along the part, 0 in space"),
    "contact/u_t": ("length", "displacement along the tangents"),
    "contact/sigma_t": ("stress", "traction along the tangents"),
    "contact/sigma_n": ("stress", "traction along the outward normal, negative in compression"),
    "contact/friction_bound": ("stress", "g, the largest |sigma_t|"),
    "contact/state": ("1", "0 stick, 1 slip, 2 open"),
    "contact/part": ("1", "name of the part of each contact node"),
    "history/rho": ("stress/length", "Robin parameter of the step"),
    "history/w": ("stress/length", "change of sigma_t over change of u_t in the step"),
    "history/change": ("1", "relative change in the step, which the stopping criterion looks at"),
    "history/residual": ("stress*length^(1/2)", "norm of the friction residual of the iterate that the step starts from"),
    "history/ksp_iterations": ("1", "KSP iterations of the step"),
    "history/exchanged": ("1", "nodes on the wrong side after each Newton step, the last rows"),
}
"""Unit and meaning of the datasets of a result."""


def write_solution(path: str | Path, solution: Solution | AssemblySolution, *, replace: bool = True) -> None:
    """Write a result file: to a temporary name, flushed to the disk, then renamed.

    Parameters
    ----------
    path : str or Path
    solution : Solution or AssemblySolution
        Written in format 1 or 2.
    replace : bool
        Whether a file of that name may be replaced; if not, and there is one, the result is kept beside it.

    Raises
    ------
    OutputError
        If the file cannot be written (folder missing or read-only, disk full), then nothing is left behind; or if it is
        kept under another name.
    """
    from .steps.hdf5 import fill

    if isinstance(solution, AssemblySolution):
        write_atomically(path, lambda file: fill(file, solution), replace=replace)
    else:
        write_atomically(path, lambda file: write_group(file, solution), replace=replace)


def write_atomically(path: str | Path, fill: Callable[[h5py.File], None], *, replace: bool = True) -> None:
    """Let `fill` write an HDF5 file that appears under its name only when it is whole and on the disk."""
    with temporary_name(path, replace=replace) as temporary:
        # built in memory: HDF5 crashes the process when the disk fills up under a file of its own
        with h5py.File("result", "w", driver="core", backing_store=False, track_order=True) as file:
            fill(file)
            file.flush()
            image = file.id.get_file_image()
        temporary.write_bytes(image + SEAL + hashlib.sha256(image).digest())


def write_group(group: Any, solution: Solution) -> None:
    """One case into an HDF5 file or group."""
    mesh, contact, history = solution.mesh, solution.contact, solution.history
    names = np.array(mesh.part_names, dtype=object)
    text = h5py.string_dtype()
    boundary = group.create_group("boundary")
    for key, value in (("x", mesh.x), ("normal", mesh.normal), ("weight", mesh.weight), ("u", solution.u),
                       ("traction", solution.traction)):  # fmt: skip
        boundary[key] = value
    boundary.create_dataset("part", data=names[mesh.node_part], dtype=text)
    write_mesh(group.create_group("mesh"), mesh)
    contacts = group.create_group("contact")
    for key in ("nodes", "x", "tangent", "weight", "arc_length", "u_t", "sigma_t", "sigma_n", "friction_bound", "state"):
        values = getattr(contact, key)
        # a single tangent has no axis of its own
        contacts[key] = values[:, 0] if key == "tangent" and values.shape[1] == 1 else values
    contacts.create_dataset("part", data=contact.part.astype(object), dtype=text)
    rows = group.create_group("history")
    for key in COLUMNS:
        rows[key] = np.array(getattr(history, key), dtype=int if key == "ksp_iterations" else float)
    if history.exchanged:
        rows["exchanged"] = np.array(history.exchanged, dtype=int)
    describe_all(group, solution.case.units)
    group.attrs.update({
        "format": FORMAT, "format_version": FORMAT_VERSION, "config": solution.case.toml(), "status": solution.status,
        "reason": solution.reason, "iterations": solution.iterations, "rho": solution.rho,
        "residual": solution.residual, "elastic_residual": solution.elastic_residual,
        "timings": json.dumps(solution.timings), "info": json.dumps(solution.info),
        **zone_attributes(solution.zones), **{key: str(solution.info.get(key, "")) for key in PROVENANCE},
    })  # fmt: skip


def zone_attributes(zones: list[Zone]) -> dict[str, Any]:
    """Attributes `zones` (k, 3): start, end [length], sign; and `zone_parts`, their parts as JSON."""
    return {"zones": np.array([[z.start, z.end, z.sign] for z in zones]).reshape(-1, 3),
            "zone_parts": json.dumps([z.part for z in zones])}  # fmt: skip


def describe_all(group: Any, units: Units) -> None:
    """Describe the datasets of DESCRIPTIONS that there are."""
    for path, meaning in DESCRIPTIONS.items():
        if path in group:
            describe(group[path], meaning, units)


def describe(item: Any, meaning: tuple[str, str] | None, units: Units) -> None:
    """Attributes `unit` and `description` of a dataset; the unit is the user's name for it, where there is one."""
    if meaning is not None and isinstance(item, h5py.Dataset):
        names = {"length": units.length, "stress": units.stress, "stress/length": units.stiffness}
        item.attrs.update({"unit": names.get(meaning[0]) or meaning[0], "description": meaning[1]})


def read_result(path: str | Path, group: str = "/") -> Solution | AssemblySolution:
    """What a result file of either format holds.

    Raises
    ------
    ResultError
        As `read_solution`.
    """
    from .steps.hdf5 import FORMAT_VERSION as WITH_STEPS
    from .steps.hdf5 import read_assembly

    with opened(path) as file:
        if group in file and file[group].attrs.get("format_version") == WITH_STEPS:
            return read_assembly(file[group], f"{path}")
    return read_solution(path, group)


def read_solution(path: str | Path, group: str = "/") -> Solution:
    """A solution of the paper's problem, one body and no steps, from a result file.

    Raises
    ------
    ResultError
        If the file is missing, truncated, not HDF5, not ours, or of another format version.
    """
    with opened(path) as file:
        if group not in file:
            raise ResultError(f"{path}: no case {group!r}; there are {', '.join(file)}")
        check_link(file, group, f"{path}")
        return read_group(file[group], f"{path}")


@contextlib.contextmanager
def opened(path: str | Path) -> Iterator[h5py.File]:
    """An HDF5 file of ours, opened for reading; whatever is wrong with it is a `ResultError` of one line."""
    try:
        if not Path(path).is_file():
            raise ResultError(f"{path}: no such file")
        _check_seal(Path(path))
        with h5py.File(path, "r") as file:
            yield file
    except PetcontactError:
        raise
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise ResultError(f"{path}: not a whole HDF5 file ({reason})") from None


def _check_seal(path: Path) -> None:
    """Refuse a file whose bytes are not those that were written; one without a hash (older, or changed by h5py) passes."""
    length = len(SEAL) + hashlib.sha256().digest_size
    with open(path, "rb") as file:
        size = file.seek(0, os.SEEK_END) - length
        file.seek(max(size, 0))
        tail = file.read()
        cut = SEAL in tail[1:] or any(tail.endswith(SEAL[:k]) for k in range(4, len(SEAL)))
        if not (cut or tail.startswith(SEAL)):
            return
        file.seek(0)
        found, left = hashlib.sha256(), size
        while not cut and left > 0 and (block := file.read(min(left, 1 << 20))):
            found.update(block)
            left -= len(block)
    if cut or found.digest() != tail[len(SEAL) :]:
        raise ResultError(f"{path}: damaged (its bytes are not those that were written)")


def read_group(group: Any, source: str) -> Solution:
    """A solution from an HDF5 group."""
    attributes = dict(group.attrs)
    if attributes.get("format") != FORMAT:
        raise ResultError(f"{source}: not a result of petcontact")
    if attributes.get("format_version") != FORMAT_VERSION:
        found = attributes.get("format_version")
        hint = "; read_result reads bodies and load steps" if found == 2 else ""
        raise ResultError(f"{source}: format version {found}, this is {FORMAT_VERSION}{hint}")
    if "boundary" not in group:
        raise ResultError(f"{source}: holds no fields, the case failed ({attributes.get('reason')})")
    try:
        return _read(group, attributes, source)
    except ResultError:
        raise
    except Exception as error:  # whatever damaged bytes make of h5py and numpy
        raise ResultError(f"{source}: damaged ({type(error).__name__}: {' '.join(str(error).split())})") from error


def _read(group: Any, attributes: dict[str, Any], source: str) -> Solution:
    import tomllib

    check_group(group, source)
    mesh = read_mesh(group["mesh"], source)
    stored = group["contact"]
    x = stored["x"][()]
    contact = ContactFields(**{
        key: np.array([name.decode() for name in stored[key][()]]) if key == "part" else stored[key][()]
        for key in ContactFields.__dataclass_fields__ if key != "tangent"
    }, tangent=stored["tangent"][()].reshape(len(x), -1, x.shape[1]))  # fmt: skip
    check_contact(mesh, vars(contact), source)
    fields = {key: group[f"boundary/{key}"][()] for key in ("u", "traction")}
    check_fields(mesh, fields, source)
    rows = group["history"]
    history = History(**{key: rows[key][()].tolist() for key in (*COLUMNS, *["exchanged"] * ("exchanged" in rows))})
    check_history(vars(history), source)
    parts = json.loads(attributes["zone_parts"])
    zones = [Zone(part, float(a), float(b), int(s)) for part, (a, b, s) in zip(parts, attributes["zones"], strict=True)]
    case: Case = parse(Case, tomllib.loads(attributes["config"]), source)
    return Solution(
        case, mesh, fields["u"], fields["traction"], contact, zones, history,
        str(attributes["status"]), str(attributes["reason"]), float(attributes["rho"]), float(attributes["residual"]),
        float(attributes["elastic_residual"]), read_table(attributes["timings"], f"{source}: timings", numbers=True),
        read_table(attributes["info"], f"{source}: info"),
    )  # fmt: skip
