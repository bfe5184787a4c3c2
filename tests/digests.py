"""A fingerprint of all digits of a solve."""

from __future__ import annotations

import hashlib

import numpy as np
from examples import example

from petcontact import MeshOptions, solve

MESH = MeshOptions(element_size=0.2)


def digest(number, formulation, comm):
    solution = solve(example(number, mesh=MESH, formulation=formulation), comm=comm)
    fields = [
        solution.u,
        solution.traction,
        solution.contact.u_t,
        solution.contact.sigma_t,
        np.array(solution.last.history.rho),
        np.array(solution.last.history.change),
        np.array(solution.last.history.residual),
    ]
    return hashlib.sha256(
        b"".join(np.ascontiguousarray(field).tobytes() for field in fields)
    ).hexdigest()
