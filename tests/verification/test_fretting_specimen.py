"""The fretting specimen of Kosec and others (2019) against Nowell and Hills: σ_xx at the trailing
edge. Sizes of contact and stick zone: the verification manual, B11.

The specimen is 10 mm high, and no half plane: pressing alone pulls its surface by 12.5 MPa under
the pad (σ_xx + p, read in the middle of the contact), and half of the shear is gone from the stress
far away.
"""

from __future__ import annotations

import numpy as np
import pytest
from shapes import drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import adapt
from petcontact.reference.hertz import LineContact, contact_modulus
from petcontact.reference.nowell_hills import FrettingContact

ALUMINIUM, MODULUS = elastic(72100.0, 0.33), contact_modulus(72100.0, 0.33, 72100.0, 0.33)
P, Q, BULK, HALF, RADIUS, FRICTION = 135.75, 38.75, 100.0, 5.0, 50.0, 0.85


@pytest.mark.slow
def test_the_stress_at_the_trailing_edge():
    sag = RADIUS - np.sqrt(RADIUS**2 - 25.0)
    face = [
        {"part": "face", "to": [5.0, sag], "radius": RADIUS},
        {"part": "side", "to": [5.0, 10.0]},
        {"part": "top", "to": [-5.0, 10.0]},
        {"part": "other side", "to": [-5.0, sag]},
    ]
    specimen = solid(
        "specimen",
        rectangle([-20.0, -HALF], [20.0, 0.0]),
        {"part": "bottom", "condition": "symmetry"},
        moved("left", [0.0, "free"]),
        drawn("right", [0.0, 0.0]),
        material=ALUMINIUM,
    )
    pad = solid("pad", {"shape": "outline", "loops": [face]}, material=ALUMINIUM)
    pulled = {"body": "specimen", "part": "right", "value": [BULK, 0.0]}
    fretting = problem(
        body=[specimen, pad],
        obstacle=[{"name": "platen", "displacement": ["free", "free"]}],
        contact=[
            touching("grip", "pad.top", "platen", normal="bonded"),
            touching("contact", "specimen.top", "pad.face", friction_coefficient=FRICTION),
        ],
        step=[
            {"name": "press", "obstacle": [{"name": "platen", "force": [0.0, -P]}]},
            {
                "name": "push",
                "obstacle": [{"name": "platen", "force": [-Q, -P]}],
                "boundary": [pulled],
            },
        ],
    )
    solution = adapt(fretting, 2e-3)
    assert solution.converged
    exact = FrettingContact(LineContact(P, RADIUS, MODULUS), FRICTION, Q, BULK)
    pressed = sum(step.name == "press" for step in solution.steps)
    ((xx, yy, _),) = solution.stress_at([[0.0, 0.0]], "specimen", pressed)
    largest = solution.boundary_state("specimen")[1].stress[:, 0].max()
    assert largest == pytest.approx(exact.trailing_stress + (xx - yy) - 0.5 * Q / HALF, rel=0.01)
    assert largest == pytest.approx(exact.trailing_stress, rel=0.05)
