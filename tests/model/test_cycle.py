"""Cycles that do not exist, do not close, or wear nothing are refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from shapes import touching

from petcontact import InputError, load
from petcontact.pipeline.pose.discretise import discretise

CONFIG = Path(__file__).parents[2] / "configs/fretting_specimen.toml"
"""A specimen and a pad that is pressed on it; the cycle of its steps is a pull and a push."""
LEANS = {"name": "push", "boundary": [{"body": "specimen", "part": "left", "value": [0.1, "free"]}]}
SMOOTH = touching("fretting", "specimen.contact", "pad.face")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cycle.count": 0}, "cycle.count: must be greater than or equal to 1"),
        ({"cycle.jump": 0}, "cycle.jump: must be a whole number from 1"),
        ({"cycle.tolerance": 0.0}, "cycle.tolerance: must be greater than 0"),
        ({"cycle.first": "pusch"}, "cycle.first: no step 'pusch', did you mean 'push'?"),
        ({"cycle.first": "push", "cycle.last": "pull"}, "'pull' comes before step 'push'"),
        ({"step.2": LEANS}, "does not close: step 'pull' ends elsewhere the second time"),
        ({"cycle.last": "pull"}, "from the second time on nothing moves in step 'pull'"),
        ({"step.2.name": "pull"}, "cycle.first: 2 steps are called 'pull'"),
        ({"contact.1": SMOOTH}, "cycle: nothing changes from cycle to cycle"),
        ({"contact.1.normal": "bilateral"}, "wear opens a gap, and bilateral parts have"),
        ({"contact.1.wear_share": 1.5}, "contact[1].wear_share: must be less than or equal to 1"),
        ({"contact.1.wear_coefficient": -1e-3}, "[1].wear_coefficient: must be >= 0, is -0.001"),
        ({"contact.1.wear_coefficient": "x - 1"}, "[1].wear_coefficient: must be >= 0, is -"),
    ],
)
def test_refused(changes, said):
    with pytest.raises(InputError) as caught:
        discretise(load(CONFIG, changes))
    assert said in str(caught.value) and "\n" not in str(caught.value)
