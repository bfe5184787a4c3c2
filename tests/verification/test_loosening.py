"""Configs with closed forms: a shrink fit that speed and heat loosen, a heated disc, the fretting
specimen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from petcontact import load, solve
from petcontact.reference.hertz import LineContact, contact_modulus

pytestmark = pytest.mark.usefixtures("unestimated")

CONFIGS = Path(__file__).parents[2] / "configs"
INNER, OUTER, YOUNG, NU = 20.0, 40.0, 210_000.0, 0.3


@pytest.mark.slow
def test_a_heated_disc_is_one_whose_plates_come_nearer():
    """By what it would grow, in plane strain (1 + ν)αT times the distance from the middle."""
    growth = 1.3 * 1.2e-5 * 40.0
    pressed = solve(
        load(
            CONFIGS / "heated_disc.toml",
            {
                "contact.0.gap": f"y + 10 + {growth}*y",
                "contact.1.gap": f"10 - y - {growth}*y",
                "step.0.loads": [],
                "step.1.loads": [],
                "contact.0.friction_coefficient": 0.0,
                "contact.1.friction_coefficient": 0.0,
            },
        )
    ).steps[3]
    free = solve(
        load(
            CONFIGS / "heated_disc.toml",
            {f"contact.{k}.friction_coefficient": 0.0 for k in range(2)},
        )
    ).steps[3]
    assert free.pairs["lower"].pressure == pytest.approx(
        pressed.pairs["lower"].pressure, rel=1e-9, abs=1e-6
    )
    assert free.pairs["lower"].force[1] == pytest.approx(-free.pairs["upper"].force[1], rel=1e-9)
    # the contact is Hertz's
    line = LineContact(free.pairs["lower"].force[1], 10.0, contact_modulus(YOUNG, NU))
    assert free.pairs["lower"].pressure.max() == pytest.approx(line.peak, rel=1e-2)


@pytest.mark.slow
def test_the_fretting_specimen():
    """p_0 of half planes within 1 %; the stick zone moves off the middle; wear grows from cycle to
    cycle."""
    solution = solve(load(CONFIGS / "fretting_specimen.toml"))
    line = LineContact(135.75, 50.0, contact_modulus(72_100.0, 0.33, 72_100.0, 0.33))
    press, pull = (solution.steps[k].pairs["fretting"] for k in (0, 1))
    assert press.pressure.max() == pytest.approx(line.peak, rel=1e-2)
    stick = pull.x[pull.state == 0, 0]
    assert 0.5 * (stick.max() - stick.min()) == pytest.approx(0.3767, abs=0.035)
    assert 0.5 * (stick.max() + stick.min()) == pytest.approx(0.0727, abs=0.035)
    volume = solution.wear.depth["fretting"] @ pull.weight
    assert solution.converged and solution.wear.cycle[-1] == 10_000
    assert np.all(np.diff(volume) > 0.0)
    worn = solution.pairs["fretting"]
    assert worn.wear.sum(axis=1)[np.abs(worn.x[:, 0]) < 0.2].max() < 0.1 * worn.worn_depth
