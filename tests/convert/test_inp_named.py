"""What an input file says is taken or named in one line, and damaged ones are refused."""

from __future__ import annotations

import re

import pytest

from petcontact.convert.inp_problem import convert_inp
from petcontact.errors import InputError

DECK = """*NODE
1,0,0
2,1,0
3,0,1
4,1,1
*ELEMENT, TYPE=CPE4, ELSET=ALL
1,1,2,4,3
*MATERIAL, NAME=M
*ELASTIC
100.,.3
*SOLID SECTION, ELSET=ALL, MATERIAL=M
2.5
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
1e5
*BOUNDARY
1,1,2
2,2,2
2,1,1
*STEP, NLGEOM
*CLOAD
3,2,-1.
*DLOAD
1,P3,1.
*END STEP
"""


def converted(tmp_path, text):
    (tmp_path / "deck.inp").write_text(text)
    return convert_inp(tmp_path / "deck.inp", "deck")


def test_nothing_is_lost_without_a_word(tmp_path):
    found = converted(tmp_path, DECK)
    for said in ("thickness 2.5", "PRESSURE-OVERCLOSURE=LINEAR", "NLGEOM"):
        assert any(re.search(said, note) for note in found.notes), said
    assert len(found.notes) == 3


def test_nodes_that_are_held_one_by_one_hold_their_faces(tmp_path):
    found = converted(tmp_path, DECK)
    assert 'part = "NODES1+NODES2"' in found.toml
    assert "value = [\n    0.0,\n    0.0,\n]" in found.toml
    alone = DECK.replace("1,1,2\n2,2,2\n2,1,1\n", "4,1,1\n")
    (note,) = [note for note in converted(tmp_path, alone).notes if "BOUNDARY" in note]
    assert "1 node (4)" in note


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("2,1,0\n", "2,nan,0\n", "node 2 has coordinates that are not finite"),
        ("*MATERIAL", "*NSET, NSET=A, GENERATE\n1,1000000000\n*MATERIAL", "are more numbers than"),
        ("1,P3,1.", "1,P3", "numbers are expected"),
        ("100.,.3", "1e999,.3", "numbers are expected"),
        ("*MATERIAL", "*BOUNDARY\n1,1,1e40\n*MATERIAL", "degrees of freedom are 1 to 99"),
        ("*MATERIAL", "*BOUNDARY\n1,2,1\n*MATERIAL", "degrees of freedom are 1 to 99"),
    ],
)
def test_numbers_that_cannot_be(tmp_path, old, new, told):
    with pytest.raises(InputError, match=rf"deck\.inp: line \d+: .*{told}"):
        converted(tmp_path, DECK.replace(old, new, 1))
