"""The verification manual: quick cases are solved again, and pages and table say what the case
files and the solver do."""

from __future__ import annotations

import json

import pytest
from verification.cases.case import DRAWN, PAGES, TABLE, digest_of, every, rows

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
    computed, _ = case.computed()
    printed = [
        [cell.strip() for cell in line.replace("\\|", "/").split("|")[1:-1]]
        for line in (PAGES / f"{case.name}.md").read_text().partition("## Tested")[2].splitlines()
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


def test_loads_in_equilibrium_by_themselves_are_no_loads():
    """Rings under pressure: the resultant is round-off, and no reason to halve the increment."""
    case = next(case for case in CASES if case.number == "B04")
    assert len(case.computed()[1].steps) == 1


def test_no_picture_is_older_than_its_case():
    """`scripts/verification CASE --write` draws again."""
    drawn = json.loads(DRAWN.read_text())
    assert drawn == {case.name: digest_of(case) for case in CASES}


def test_every_case_has_its_page_and_is_in_the_table():
    assert {path.stem for path in PAGES.glob("*.md")} == {case.name for case in CASES}
    table = TABLE.read_text()
    for case in CASES:
        assert f"[{case.number}](cases/{case.name}.md)" in table
    assert len({case.number for case in CASES}) == len(CASES)


def test_every_published_case_is_there():
    """Of the numbers that the project was asked for; letters after them are variants."""
    asked = {
        f"B{number:02}" for number in (1, 2, 3, 4, 5, 7, 9, 10, 11, 12, 13, 15, 16, 17, 19, 21)
    }
    assert asked <= {case.number.rstrip("abc") for case in CASES}
