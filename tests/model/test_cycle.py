"""Cycles that do not exist, do not close, or wear nothing are refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from shapes import drawn, elastic, moved, rectangle, touching

from petcontact import InputError
from petcontact.model.case import parse_problem
from petcontact.pipeline.pose.discretise import discretise


def problem(**changes):
    """A block and a pad that is pressed on it, and moved to and fro."""
    return parse_problem(
        {
            "material": elastic(1.0, 0.3),
            "geometry": rectangle([0.0, 0.0], [2.0, 1.0]),
            "mesh": {"element_size": 0.5},
            "boundary": [
                moved("bottom", [0.0, 0.0]),
                *(drawn(part, [0.0, 0.0]) for part in ("left", "right")),
            ],
            "obstacle": [{"name": "pad", "displacement": [0.0, -0.1]}],
            "contact": [
                touching("c", "top", "pad", friction_coefficient=0.3, wear_coefficient=1e-3)
            ],
            "step": [
                {"name": "press"},
                {"name": "push", "obstacle": [{"name": "pad", "displacement": [0.1, -0.1]}]},
                {"name": "pull", "obstacle": [{"name": "pad", "displacement": [-0.1, -0.1]}]},
                {"name": "lean", "boundary": [{"part": "left", "value": [0.01, 0.0]}]},
            ],
            "cycle": {"first": "push", "last": "pull", "count": 10},
        },
        "test.toml",
        {key.replace("__", "."): value for key, value in changes.items()},
        Path(),
    )


SMOOTH = touching("c", "top", "pad")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cycle__count": 0}, "cycle.count: must be greater than or equal to 1"),
        ({"cycle__jump": 0}, "cycle.jump: must be a whole number from 1"),
        ({"cycle__tolerance": 0.0}, "cycle.tolerance: must be greater than 0"),
        ({"cycle__first": "pusch"}, "cycle.first: no step 'pusch', did you mean 'push'?"),
        ({"cycle__first": "pull", "cycle__last": "push"}, "'push' comes before step 'pull'"),
        ({"cycle__last": "lean"}, "does not close: step 'push' ends elsewhere the second time"),
        ({"cycle__last": "push"}, "from the second time on nothing moves in step 'push'"),
        ({"step__2__name": "push"}, "cycle.first: 2 steps are called 'push'"),
        ({"contact__0": SMOOTH}, "cycle: nothing changes from cycle to cycle"),
        ({"contact__0__normal": "bilateral"}, "wear opens a gap, and bilateral parts have"),
        ({"contact__0__wear_share": 1.5}, "contact[0].wear_share: must be less than or equal to 1"),
    ],
)
def test_refused(changes, said):
    with pytest.raises(InputError) as caught:
        problem(**changes)
    assert said in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [-1e-3, "x - 1"])
def test_a_negative_coefficient(value):
    with pytest.raises(InputError, match=r"contact\[0\].wear_coefficient: must be >= 0, is -"):
        discretise(problem(contact__0__wear_coefficient=value))
