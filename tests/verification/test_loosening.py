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
AREA = OUTER**2 - INNER**2


def loosened(speed, heat):
    """p of the shrink fit [MPa]."""
    fit = YOUNG * (0.02 - 1.2e-5 * heat * INNER) * AREA / (2.0 * INNER * OUTER**2)
    return fit - 7.85e-9 * speed**2 * (3.0 + NU) * AREA / 8.0


def test_a_shrink_fit_loosens_with_speed_and_with_heat():
    solution = solve(load(CONFIGS / "shrink_fit.toml"))
    assert solution.converged
    states = ((0.0, 0.0), (4000.0 / 2**0.5, 0.0), (4000.0, 0.0), (0.0, 0.0), (0.0, 80.0))
    expected = [loosened(*state) for state in states]
    for step, pressure in zip(solution.steps, expected, strict=True):
        assert step.pairs["fit"].pressure == pytest.approx(pressure, abs=1e-6 * expected[0])
    rest, spun = (solution.steps[k].pairs["fit"].pressure.mean() for k in (0, 2))
    lift_off = 4000.0 * np.sqrt(rest / (rest - spun))
    assert loosened(lift_off, 0.0) == pytest.approx(0.0, abs=1e-6 * expected[0])
    # just below it all is closed, just above nothing is
    changes = {f"step.1.loads.{k}.angular_velocity": lift_off * (1.0 + 1e-6) for k in range(2)}
    apart = solve(load(CONFIGS / "shrink_fit.toml", changes)).steps[2].pairs["fit"]
    assert np.all(apart.state == 2) and np.all(spun > 0.0)


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
