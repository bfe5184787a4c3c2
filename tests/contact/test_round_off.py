"""What of displacements and tractions is round-off."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from reduced_system import coulomb

from petcontact.contact.criterion import displaced_by, natural_residuals


def system(u_0, compliance):
    return SimpleNamespace(
        u_0=np.array(u_0),
        weight=np.ones(len(u_0)),
        modes=None,
        apply=lambda sigma: (compliance @ sigma.ravel()).reshape(sigma.shape),
    )


@pytest.mark.parametrize("overlap", [1e-18, 1e-6])
def test_components_have_the_round_off_of_the_vector_they_belong_to(overlap):
    """Bodies that just touch: tangential displacements of 1e-20 beside gaps of .05 say nothing; an
    overlap without pressure does."""
    touching = system([[1e-20, overlap], [-2e-20, -0.05]], np.eye(4))
    residuals = natural_residuals(coulomb(2, 0.3), touching, touching.u_0, np.zeros((2, 2)))
    assert residuals == ((0.0, 0.0) if overlap < 1e-9 else (pytest.approx(0.0), 1.0))


def test_a_pair_whose_displacement_others_take_back_is_measured_by_its_own_tractions():
    """Two pairs on one body that press on each other: the first one does not move, and is
    strained; a light one that moves is measured by how it moves."""
    compliance = np.array([[1.0, 0.5], [0.5, 1.0]])
    held = system([[0.0], [0.0]], compliance)
    pairs = [slice(0, 1), slice(1, 2)]
    sigma = np.array([[-1.0], [2.0]])  # S σ = (0, 1.5)
    moved = displaced_by(held, held.apply(sigma), sigma, pairs)
    assert moved.ravel() == pytest.approx([-1.0, 1.5])
    sigma = np.array([[1.0], [2.0]])
    assert displaced_by(held, held.apply(sigma), sigma, pairs) == pytest.approx(held.apply(sigma))
