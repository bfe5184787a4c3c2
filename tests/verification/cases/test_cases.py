"""The verification manual: quick cases are solved again, and pages and table say what the case
files and the solver do."""

from __future__ import annotations

import json

import numpy as np
import pytest
from case_pictures import draw_curves, problem_picture
from matplotlib.figure import Figure
from PIL import Image
from verification.cases.case import DRAWN, PAGES, ROOT, TABLE, digest_of, every, rows

from petcontact.pipeline.pose.as_posed import as_posed
from petcontact.results.figures.model_in_space import _soft
from petcontact.results.figures.posed_parts import KINDS
from petcontact.results.figures.surface_figure import AZIMUTH, ELEVATION, SHADE, toward_eye

CASES = every()


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=() if case.quick else pytest.mark.slow, id=case.name)
        for case in CASES
    ],
)
def test_targets_are_met_and_the_page_is_current(case):
    """A value outside its tolerance needs a reason, which is printed; one with a reason that is met
    needs it no more."""
    computed, solution = case.computed()
    page = (PAGES / f"{case.name}.md").read_text()
    assert f" | {len(solution.steps)} | " in page.partition("## Mesh")[2]
    printed = [
        [cell.strip() for cell in line.replace("\\|", "/").split("|")[1:-1]]
        for line in page.partition("## Tested")[2].splitlines()
        if line.startswith("| ")
    ][2:]
    assert len(printed) == len(case.values)
    for value, found, wanted, cells in zip(
        case.values, computed, rows(case, computed), printed, strict=True
    ):
        assert value.met(found) != bool(value.missed), (value.name, found, value.reference)
        assert [cells[1], *cells[4:]] == [wanted[1], *wanted[4:]]
        # errors are small numbers: round-off and libraries move them
        near = {"rel": 1e-3} if value.reference else {"rel": 0.5, "abs": 1e-7}
        assert float(cells[2]) == pytest.approx(found, **near)
    pair = [*solution.pairs.values()][-1]
    if pair.x.shape[1] == 2 and not case.line:
        draw_curves(figure := Figure(), solution, case)
        middle = float(np.median(pair.pressure[pair.pressure > 0.0]))
        assert 0.1 * figure.axes[0].get_ylim()[1] < middle


def test_faces_have_the_colours_of_the_legend(tmp_path):
    """Shaded by their angle to the eye; contact is hidden between the cubes."""
    cubes = next(case for case in CASES if case.number == "B21")
    problem_picture(as_posed(cubes.posed()), tmp_path / "cubes.png")
    drawn = np.array(Image.open(tmp_path / "cubes.png").convert("RGB")).reshape(-1, 3)
    upwards = 1.0 - SHADE * (1.0 - toward_eye(ELEVATION, AZIMUTH)[2])
    for kind, light, least in (("held", upwards, 5000), ("free", 1.0, 50), ("contact", 1.0, 50)):
        wanted = 255.0 * light * np.array(_soft(KINDS[kind]))
        assert np.sum(np.abs(drawn - wanted).max(axis=1) < 6.0) > least, kind


def test_no_picture_is_older_than_its_case_or_the_code_that_draws_it():
    """`scripts/verification CASE ... --write` draws again."""
    drawn = json.loads(DRAWN.read_text())
    old = [case.number for case in CASES if drawn.pop(case.name, "") != digest_of(case)]
    assert old == [] and drawn == {}, f"scripts/verification {' '.join(old)} --write"


def test_every_case_has_its_page_and_is_in_the_table():
    assert {path.stem for path in PAGES.glob("*.md")} == {case.name for case in CASES}
    table = TABLE.read_text()
    for case in CASES:
        assert f"[{case.number}](cases/{case.name}.md)" in table
    assert len({case.number for case in CASES}) == len(CASES)
    published = sum(case.path.parent.name == "published" for case in CASES)
    counted = f"{published} published cases and {len(CASES) - published} closed forms"
    assert counted in (ROOT / "README.md").read_text()
