"""The page that turns the bodies: what it holds, and that it needs nothing else."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest
from problems import block, contact_pair, posed
from shapes import closing, cuboid, moved, problem, rectangle, solid

from petcontact import solve
from petcontact.commands.main import main
from petcontact.results.figures.turning import UNKNOWN, scene
from petcontact.results.hdf5 import write_solution

pytestmark = pytest.mark.usefixtures("unsampled")

TITLE = "</script><b>A & B"


@pytest.fixture(scope="module", params=[2, 3], ids=["plane", "space"])
def solution(request):
    dim = request.param
    shape = rectangle([0, 0], [2, 1]) if dim == 2 else cuboid([0, 0, 0], [2, 1, 1])
    body = solid(
        "block",
        shape,
        closing("bottom", normal="unilateral", friction_coefficient=0.3),
        moved("top", [0.01, *[0.0] * (dim - 2), -0.02]),
        mesh={"element_size": 0.5, "order": 1},
    )
    return solve(problem(title=TITLE, body=[body], step=[{"name": "one", "increments": 2}]))


def unpacked(text, kind, *shape):
    return np.frombuffer(base64.b64decode(text), kind).reshape(-1, *shape)


def test_the_page_holds_the_fields_of_the_solution(solution):
    found = scene(solution)
    body, dim = found["bodies"][0], solution.mesh.dim
    assert body["away"] == [0.0] * 3
    x, triangles = unpacked(body["x"], "<f4", 3), unpacked(body["triangles"], "<u4", 3)
    assert triangles.max() < len(x) and unpacked(body["rims"], "<u4", 2).max() < len(x)
    assert len(found["steps"]) == len(body["steps"]) == 2
    assert found["steps"][-1] == "one, load factor 1"
    last, top = body["steps"][-1], np.abs(x[:, dim - 1] - 1.0) < 1e-6
    move = unpacked(last["move"], "<f4", 3)
    # elements of the sides have values of their own at the edge
    assert np.median(move[top], axis=0)[[0, dim - 1]] == pytest.approx([0.01, -0.02], rel=0.02)
    fields = {field["key"]: field for field in found["fields"]}
    on_contact = {"pressure", "shear", "slip", "error"} if dim == 3 else set()
    assert set(fields) == {"u", "von_mises"} | on_contact
    for key, field in fields.items():
        given = unpacked(last[key], "<u2")
        assert len(given) == len(x) and field["low"] <= 0.0 <= field["high"]
    known = unpacked(last["von_mises"], "<u2")
    state = solution.state_at([[1.0] + [0.5] * (dim - 1)])
    middle = np.median(known[known < UNKNOWN]) / (UNKNOWN - 1) * fields["von_mises"]["high"]
    assert 0.3 < middle / state.von_mises[0] < 3.0
    if dim == 3:
        slip = unpacked(last["slip"], "<u2")
        below = unpacked(body["normal"], "<f4", 3)[:, 2] < -0.5
        assert np.array_equal(slip < UNKNOWN, below)  # known on the contact only


def test_bodies_go_apart_along_the_normals_of_their_contact():
    text = block("low", [0, 0], [1, 1], mesh="element_size = 1.0", bottom=[0.0, 0.0])
    text += block("mid", [0, 1], [1, 2], mesh="element_size = 1.0")
    text += block("up", [0, 2], [1, 3], mesh="element_size = 1.0", top=[0.0, -0.02])
    text += contact_pair("a", "mid.bottom", "low.top", 0.5)
    found = scene(solve(posed(text + contact_pair("b", "mid.top", "up.bottom", 0.5))))
    assert [body["away"] for body in found["bodies"]] == [[0, -1, 0], [0, 0, 0], [0, 1, 0]]


def test_the_page_needs_nothing_else(solution, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_solution("r.h5", solution)
    assert main(["plot", "r.h5", "--html", "-o", "pages"]) == 0
    assert capsys.readouterr().out == "pages/r.html\n"
    text = (tmp_path / "pages" / "r.html").read_text()
    pictures = re.findall(r'src="data:image/png;base64,[^"]*"', text)
    assert len(pictures) == (2 if solution.mesh.dim == 2 else 0)
    text = re.sub(r'src="data:image/png;base64,[^"]*"', "", text)
    assert not re.search(r"https?:|//\w+\.|src=|@import|<link", text)
    assert "default-src 'none'" in text and text.count("</script>") == 2 and TITLE not in text
    inside = re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)
    assert json.loads(inside[1]) == scene(solution)
