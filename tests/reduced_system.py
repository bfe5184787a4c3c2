"""A contact system from a matrix, without bodies, and the law of its nodes."""

from __future__ import annotations

import numpy as np

from petcontact.compliance.composed import ComposedSystem
from petcontact.compliance.contact_compliance import DenseCompliance
from petcontact.contact.laws import SignoriniCoulomb
from petcontact.runtime.petsc import petsc


def coulomb(m, mu, k=2):
    """Unilateral contact with Coulomb friction at m nodes."""
    return SignoriniCoulomb(np.full(m, float(mu)), np.full(m, np.inf), np.ones(m, dtype=bool), k)


class ReducedSystem(ComposedSystem):
    """A contact system whose S is a given dense matrix (m k, m k) [length/stress].

    Component c of node i has number k i + c.
    """

    def __init__(self, u_0, compliance, weight, modes=None, surrogate=None):
        operator = DenseCompliance(compliance, petsc().COMM_SELF, surrogate or (lambda: None))
        super().__init__(u_0, weight, modes, operator)
