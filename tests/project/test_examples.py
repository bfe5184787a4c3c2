"""The examples run, and each gives the number that it is about; notebooks run cell by cell, without
Jupyter."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest
from marks import some

EXAMPLES = Path(__file__).parents[2] / "scripts/examples"
NUMBERS = {
    "block_in_space": pytest.approx(1.0, abs=0.02),  # of the push, found on the parts that hold
    "elastostatics": pytest.approx(30.0, rel=0.02),  # bending stress of a beam
    "fretting": pytest.approx(1.3546e-4, rel=1e-3),  # energy of a cycle
    "friction_study": pytest.approx(0.72, abs=0.03),  # share that slips
    "hertz": pytest.approx(1.0, abs=0.01),  # peak pressure over theory
    "limit_load": pytest.approx(0.8, abs=0.02),  # µ times the weight
    "measured_gap": pytest.approx(0.76, abs=0.05),  # share that is closed
    "own_rule": pytest.approx(0.0, abs=1e-4),  # difference of two rules' displacements
    "paper_example1": pytest.approx(4, abs=2),  # Newton's iterations
    "press_fit": pytest.approx(1.0, abs=1e-3),  # growth of the ring over Lamé's
    "projection_by_hand": pytest.approx(0.0, abs=1e-6),  # difference from `solve`
    "spring_bed": pytest.approx(1.0, abs=0.01),  # force over that of springs
}
NOTEBOOKS = {
    "first_contact": lambda names: (
        names["solution"].converged and names["shares"][0.2] > names["shares"][0.4] + 0.1
    ),
    "lesson1_block": lambda names: names["ends"] == pytest.approx([3.3778, 4.1113], abs=1e-3),
    "lesson2_hertz": lambda names: names["ratio"] == pytest.approx(1.0, abs=0.01),
    "lesson3_two_bodies": lambda names: (
        abs(names["pair"].force[0]) < 0.4 * names["pair"].force[1] and names["solution"].converged
    ),
    "operators": lambda names: names["difference"] < 1e-6 and names["asymmetry"] < 0.05,
}


QUICK = {*NUMBERS} - {"limit_load", "hertz", "friction_study", "block_in_space", "measured_gap"}


@pytest.mark.parametrize("name", some(QUICK, NUMBERS))
def test_an_example_gives_its_number(name, capsys):
    assert runpy.run_path(str(EXAMPLES / f"{name}.py"))["result"] == NUMBERS[name]
    assert capsys.readouterr().out
    assert 10 <= len((EXAMPLES / f"{name}.py").read_text().splitlines()) <= 64


def resolved(text):
    """What is printed, but for times and round-off."""
    return re.sub(r"(time \[s\]|elasticity ).*", r"\1", text)


@pytest.mark.parametrize("name", some(["lesson2_hertz", "operators"], NOTEBOOKS))
def test_a_notebook_runs(name, capsys, monkeypatch):
    monkeypatch.setattr(matplotlib.rcParams, "backend", "agg", raising=False)
    cells = json.loads((EXAMPLES / f"{name}.ipynb").read_text())["cells"]
    names: dict[str, object] = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"]  # it is read unrun
            exec(compile("".join(cell["source"]), f"{name}.ipynb", "exec"), names)
            stored = [line for out in cell["outputs"] for line in out.get("text", ())]
            printed = capsys.readouterr().out if stored else ""
            assert resolved(printed) == resolved("".join(stored))  # as it is read unrun
    assert NOTEBOOKS[name](names)
    plt.close("all")


def test_every_example_is_listed():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(NUMBERS)
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} == set(NOTEBOOKS)
