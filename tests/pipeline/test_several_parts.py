"""One contact of several parts is the same problem as several contacts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from shapes import problem, solid, touching

from petcontact import (
    Body,
    Displacement,
    InputError,
    Material,
    MeshOptions,
    Method,
    Obstacle,
    Pair,
    Problem,
    Rectangle,
    Traction,
    read_result,
    solve,
)

MESH = MeshOptions(element_size=0.25, order=1)
BEAM = Body(
    "beam",
    Material(1000.0, 0.3),
    Rectangle((-2, 0), (2, 1)),
    MESH,
    (Traction("top", (0.0, -1.0)), Displacement("left", (0.0, "free"))),
)
BENCHES = (
    Body(
        "left_bench",
        Material(1000.0, 0.3),
        Rectangle((-2, -1), (-1, 0)),
        MESH,
        (Displacement("bottom", (0.0, 0.0)),),
    ),
    Body(
        "right_bench",
        Material(500.0, 0.3),
        Rectangle((1, -1), (2, 0)),
        MESH,
        (Displacement("bottom", (0.0, 0.0)),),
    ),
)
ROLLER = Obstacle("roller", shape="circle", centre=(0.0, -2.0), radius=2.0)
PRIMARIES = ("left_bench.top", "right_bench.top", "roller")


def beam(contact: list[Pair], **more: Any) -> Problem:
    return Problem(body=(BEAM, *BENCHES), obstacle=[ROLLER], contact=contact, **more)


ONE = Pair("seat", "beam.bottom", PRIMARIES, friction_coefficient=0.2)


@pytest.fixture(scope="module")
def one() -> Any:
    return solve(beam([ONE]))


def test_one_contact_of_several_parts_is_several_contacts(one: Any) -> None:
    apart = solve(
        beam(
            [
                Pair(f"{k}", "beam.bottom", name, friction_coefficient=0.2)
                for k, name in enumerate(PRIMARIES)
            ]
        )
    )
    for k, name in enumerate(PRIMARIES):
        np.testing.assert_allclose(
            one.pairs[f"seat: {name} on beam.bottom"].force, apart.pairs[f"{k}"].force, atol=1e-9
        )
    whole = one.pairs["seat"]
    assert whole.force[1] == pytest.approx(4.0)
    assert len(whole.x) == 2 * 16
    # each node is that of the bench below it, or of the roller in the middle
    wanted = np.select([whole.x[:, 0] < -1.0, whole.x[:, 0] > 1.0], [0, 1], 2)
    np.testing.assert_array_equal(whole.primary, wanted)
    shares = one.last.shares_of("seat")
    assert list(shares) == [f"{name} on beam.bottom" for name in PRIMARIES]
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["roller on beam.bottom"] == pytest.approx(0.344, abs=0.001)


def test_a_file_tells_which_primary_a_node_meets(one: Any, tmp_path: Path) -> None:
    one.save(tmp_path / "seat.h5")
    with h5py.File(tmp_path / "seat.h5") as file:
        whole = file[f"steps/{len(one.steps)}/contact/seat"]
        assert set(whole["primary"][()]) == {0, 1, 2}
        assert whole.attrs["overlap"] == 0.0
        assert whole.attrs["force"][1] == pytest.approx(4.0)
        assert whole.attrs["shares"].sum() == pytest.approx(1.0)
    back = read_result(tmp_path / "seat.h5")
    np.testing.assert_array_equal(back.pairs["seat"].primary, one.pairs["seat"].primary)
    assert list(back.pairs) == list(one.pairs)
    assert "roller on beam.bottom" in back.verdict()
    assert "share" in back.verdict()
    again = solve(beam([ONE], method=Method(start=f"{tmp_path / 'seat.h5'}")))
    assert again.converged
    assert again.pairs["seat"].force == pytest.approx(one.pairs["seat"].force, abs=0.01)


def test_a_node_between_two_takes_the_nearer_one() -> None:
    planes = [
        Obstacle("floor", shape="plane", point=(0.0, -0.01), normal=(0.0, 1.0)),
        Obstacle("step", shape="circle", centre=(0.0, -1.0), radius=1.0),
    ]
    problem = Problem(
        body=(BEAM,),
        obstacle=planes,
        contact=[Pair("ground", "beam.bottom", ["floor", "step"])],
    )
    solution = solve(problem)
    whole = solution.pairs["ground"]
    near = np.abs(whole.x[:, 0]) < np.sqrt(1.0 - 0.99**2)
    np.testing.assert_array_equal(whole.primary, near)
    assert whole.force[1] == pytest.approx(4.0)


def test_bonded_parts_may_be_several() -> None:
    both = Problem(
        body=(BEAM, *BENCHES),
        contact=[Pair("glue", "beam.bottom", PRIMARIES[:2], normal="bonded")],
    )
    solution = solve(both)
    assert solution.converged
    assert solution.pairs["glue"].force[1] == pytest.approx(4.0)
    unmet = np.abs(solution.pairs["glue"].x[:, 0]) < 1.0
    assert (solution.pairs["glue"].primary[unmet] == -1).all()
    assert not solution.pairs["glue"].size[unmet].any()


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ({"primary": ["roller", "rolller"]}, "contact[0].primary: must be"),
        ({"primary": ["roller", "roller"]}, "primary: 'roller' is named twice"),
        ({"primary": ["roller", 3]}, "primary: must be a name or a list of names"),
        ({"primary": []}, "primary: must be a name or a list of names"),
        ({"primary": ["roller", "beam.bottom"]}, "is the secondary side itself"),
        ({"primary": ["roller", "left_bench.top"], "gap": 0.1}, "contact[0].gap: several"),
        ({"primary": ["roller", "left_bench.top"], "normal": "bonded"}, "contact[0].normal: sev"),
        ({"primary": ["roller", "left_bench.top"], "preload": 3.0}, "preload: is of one"),
        ({"primary": ["left_bench.tip", "right_bench.top"]}, "no part 'tip'"),
    ],
)
def test_lists_that_are_refused(pair: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message.replace("[", r"\[").replace("]", r"\]")) as info:
        solve(beam([Pair(name="seat", secondary="beam.bottom", **pair)]))
    assert "\n" not in str(info.value)


def test_an_obstacle_among_several_needs_a_shape() -> None:
    with pytest.raises(InputError, match="obstacle 'floor' has no shape"):
        Problem(
            body=(BEAM, *BENCHES),
            obstacle=[Obstacle("floor")],
            contact=[Pair("seat", "beam.bottom", ["floor", "left_bench.top"])],
        )


@pytest.mark.usefixtures("unestimated", "unsampled")
def test_a_node_stands_once_in_the_contact_of_a_body_on_several_tools(tmp_path: Path) -> None:
    rollers = [
        Obstacle(name, shape="circle", centre=(x, -2.0), radius=2.0)
        for name, x in (("left", -1.0), ("right", 1.0))
    ]
    problem = Problem(
        material=BEAM.material,
        geometry=BEAM.geometry,
        mesh=MESH,
        boundary=[*BEAM.boundary, Traction("right", (0.0, 0.0))],
        obstacle=rollers,
        contact=[Pair("seat", "bottom", ("left", "right"), friction_coefficient=0.2)],
    )
    solution = solve(problem)
    solution.save(tmp_path / "beam.h5")
    with h5py.File(tmp_path / "beam.h5") as file:
        contact = {key: values[:] for key, values in file["contact"].items() if key != "part"}
    assert len(np.unique(contact["x"], axis=0)) == len(contact["x"]) == 32
    assert contact["weight"].sum() == pytest.approx(4.0)
    assert -contact["weight"] @ contact["sigma_n"] == pytest.approx(4.0)
    assert solution.columns()["pair"].tolist().count("seat: right on bottom") > 0


def test_two_contacts_may_share_a_part() -> None:
    """A disc between two plates, with one part that lies in both contacts, as with a part for each.

    Where both hold a node its tractions are not unique."""
    forces = list[float]()
    for left in ("left", "left"), ("below", "above"):
        loop = [
            {"part": part, "to": to, "radius": 1.0}
            for part, to in (
                (left[1], [-1.0, 0.0]),
                (left[0], [0.0, -1.0]),
                ("lower", [1.0, 0.0]),
                ("upper", [0.0, 1.0]),
            )
        ]
        disc = solid("disc", {"shape": "outline", "loops": [loop]})
        floor = touching("floor", "disc.lower", "floor", gap="y + 1", direction=[0.0, -1.0])
        lid = touching("lid", "disc.upper", "lid", gap="1 - y", direction=[0.0, 1.0])
        for pair, own in zip((floor, lid), left, strict=True):
            pair["secondary"] = [pair["secondary"], f"disc.{own}"]
        tools = [{"name": "floor"}, {"name": "lid", "displacement": [0.0, -0.05]}]
        found = solve(problem(body=[disc], obstacle=tools, contact=[floor, lid]))
        assert found.converged
        pairs = [pair for name, pair in found.pairs.items() if name.startswith("floor")]
        forces.append(sum(float(pair.weight @ pair.pressure) for pair in pairs))
    assert forces[0] == pytest.approx(forces[1], rel=1e-5)
