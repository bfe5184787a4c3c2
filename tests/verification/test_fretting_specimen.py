"""The fretting specimen of Kosec and others (2019) against Nowell and Hills: p_0, a, c, e, and σ_xx
at the trailing edge.

The specimen is 10 mm high, and no half plane: pressing alone pulls its surface by 12.5 MPa under
the pad (σ_xx + p, read in the middle of the contact), and half of the shear is gone from the stress
far away.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from petcontact import adapt
from petcontact.model.case import parse_problem
from petcontact.reference.hertz import LineContact, contact_modulus
from petcontact.reference.nowell_hills import FrettingContact

MODULUS, P, Q, BULK, HALF = contact_modulus(72100.0, 0.33, 72100.0, 0.33), 135.75, 38.75, 100.0, 5.0
TEXT = """
[[body]]
name = "specimen"
material = {{ young_modulus = 72100.0, poisson_ratio = 0.33 }}
geometry = {{ shape = "rectangle", lower_left = [-20.0, -5.0], upper_right = [20.0, 0.0] }}
[[body.boundary]]
part = "bottom"
condition = "symmetry"
[[body.boundary]]
part = "left"
condition = "displacement"
value = [0.0, "free"]
[[body.boundary]]
part = "right"
condition = "traction"
value = [0.0, 0.0]
[[body]]
name = "pad"
material = {{ young_modulus = 72100.0, poisson_ratio = 0.33 }}
[body.geometry]
shape = "outline"
loops = [[{{ part = "face", to = [5.0, {sag}], radius = {radius} }}, {{ part = "side", to = [5.0, 10.0] }},
          {{ part = "top", to = [-5.0, 10.0] }}, {{ part = "other side", to = [-5.0, {sag}] }}]]
[[obstacle]]
name = "platen"
displacement = ["free", "free"]
[[contact]]
name = "grip"
secondary = "pad.top"
primary = "platen"
normal = "bonded"
[[contact]]
name = "contact"
secondary = "specimen.top"
primary = "pad.face"
friction_coefficient = {friction}
[[step]]
name = "press"
[[step.obstacle]]
name = "platen"
force = [0.0, -135.75]
[[step]]
name = "push"
[[step.obstacle]]
name = "platen"
force = [-38.75, -135.75]
[[step.boundary]]
body = "specimen"
part = "right"
value = [100.0, 0.0]
"""


@pytest.mark.slow
@pytest.mark.parametrize("radius", [10.0, 50.0])
@pytest.mark.parametrize("friction", [0.3, 0.85, 2.0])
def test_the_fretting_specimen(radius, friction):
    text = TEXT.format(radius=radius, friction=friction, sag=radius - np.sqrt(radius**2 - 25.0))
    solution = adapt(parse_problem(tomllib.loads(text), "specimen", {}, Path()), 2e-3)
    assert solution.converged
    exact = FrettingContact(LineContact(P, radius, MODULUS), friction, Q, BULK)
    pressed, pushed = (step.pairs["contact"] for step in solution.steps)
    a, c, e = exact.contact.half_width, exact.stick_half_width, exact.stick_offset
    assert pressed.pressure.max() == pytest.approx(exact.contact.peak, rel=0.01)
    assert 0.5 * pressed.area == pytest.approx(a, rel=0.01)
    sticks = pushed.x[pushed.state == 0, 0]
    closed = pushed.x[pushed.state != 2, 0]
    assert 0.5 * np.ptp(sticks) == pytest.approx(c, abs=0.01 * a)
    assert 0.5 * (closed.max() + closed.min()) - 0.5 * (
        sticks.max() + sticks.min()
    ) == pytest.approx(e, abs=0.01 * a)
    ((xx, yy, _),) = solution.stress_at([[0.0, 0.0]], "specimen", 1)
    largest = solution.boundary_state("specimen")[1].stress[:, 0].max()
    assert largest == pytest.approx(exact.trailing_stress + (xx - yy) - 0.5 * Q / HALF, rel=0.01)
    assert largest == pytest.approx(exact.trailing_stress, rel=0.05)
