"""Accuracy, provenance and findings in result files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import h5py
import numpy as np

from ...mesh.storage import demand
from ...untyped import Group
from ..report import Accuracy, Finding, Provenance, from_table
from .checks import read_table

FINDING = np.dtype(
    [
        (each.name, float if each.name in ("measured", "limit") else h5py.string_dtype())
        for each in fields(Finding)
    ]
)
"""A row of /findings."""


def write_findings(group: Group, findings: Sequence[Finding]) -> None:
    """/findings, a table with a row a finding and a column a field."""
    rows = [tuple(getattr(each, name) for name in FINDING.names or ()) for each in findings]
    group["findings"] = np.array(rows, dtype=FINDING)


def read_report(
    group: Group, attributes: Mapping[str, object], source: str
) -> tuple[Accuracy, Provenance, tuple[Finding, ...]]:
    """Return what a file reports of its solve."""
    accuracy, provenance = (
        read_table(attributes[key], f"{source}: {key}") for key in ("accuracy", "provenance")
    )
    rows = group["findings"][()]
    demand(rows.dtype.names == FINDING.names, f"{source}: findings is another table")
    plain: list[list[Any]] = [
        [value.decode() if isinstance(value, bytes) else float(value) for value in row]
        for row in rows.tolist()
    ]
    findings = tuple(Finding(*row) for row in plain)
    return from_table(Accuracy, accuracy), from_table(Provenance, provenance), findings
