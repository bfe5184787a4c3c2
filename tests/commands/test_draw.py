"""`petcontact draw`: a problem as it is posed."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver

from petcontact import load
from petcontact.commands.main import main
from petcontact.contact.law_protocol import OPEN
from petcontact.pipeline.pose.as_posed import as_posed
from petcontact.results.figures.model import draw_model
from petcontact.results.figures.posed_parts import parts_of

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("name", ["wedge", "axial_ball", "space_sphere"])
def test_problems_of_every_kind_are_drawn_without_a_solve(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("petcontact.pipeline.run.prepare", None)
    assert main(["draw", str(CONFIGS / f"{name}.toml")]) == 0
    assert capsys.readouterr().out == f"{name}-model.png\n"
    assert Path(f"{name}-model.png").stat().st_size > 10_000


def test_a_part_has_what_holds_on_it_at_the_end_of_the_last_step():
    problem = load(CONFIGS / "blade.toml")
    solution = as_posed(problem)
    parts = {(part.body, part.name): part for part in parts_of(solution)}
    assert parts["disc", "bottom"].kind == "held"
    assert parts["disc", "bottom"].text == "u = [0, 0]"
    assert parts["blade", "top"].kind == "loaded" and parts["blade", "top"].text == "t = [0, 50]"
    assert parts["blade", "left neck"].kind == "free" and not parts["blade", "left neck"].text
    assert parts["blade", "left flank"].text.endswith("unilateral, friction coefficient 0.3")
    top = solution.meshes["blade"].nodes_of("top")
    assert np.allclose(solution.bodies["blade"].traction[top], (0.0, 50.0))
    assert all(np.all(pair.state == OPEN) for pair in solution.pairs.values())


def test_a_rigid_sphere_is_a_net_above_the_face_that_it_may_touch():
    """At its gap, (x² + y²)/40; a body that is no obstacle has none."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    figure = Figure(layout="constrained")
    draw_model(figure, as_posed(load(CONFIGS / "space_sphere.toml")))
    (net,) = (each for each in figure.axes[0].collections if type(each) is Line3DCollection)
    x = np.concatenate(net._segments3d)
    assert np.abs(x[:, 2] - (x[:, 0] ** 2 + x[:, 1] ** 2) / 40.0).max() < 0.001
    assert 0.1 < x[:, 2].max() < 0.12


def test_faces_between_blocks_have_no_name_but_their_law_in_the_title():
    draw_model(figure := Figure(layout="constrained"), as_posed(load(CONFIGS / "space_stack.toml")))
    names = [text.get_text().partition("\n")[0] for text in figure.axes[0].texts]
    assert sorted(names) == ["front", "front", "right", "right", "top"]
    assert "pair interface: unilateral, friction coefficient 0.3" in figure._suptitle.get_text()


def test_arrows_are_even_and_names_apart_in_a_narrow_picture():
    """The thread is higher than wide, and its mesh is graded; its law stands once."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    draw_model(figure, as_posed(load(CONFIGS / "axial_thread.toml")))
    (axes,) = figure.axes
    (load_arrows,) = (each for each in axes.collections if isinstance(each, Quiver))
    apart = np.diff(np.sort(load_arrows.XY[:, 0]))
    assert len(apart) > 4 and np.allclose(apart, apart[0], rtol=1e-9)
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in axes.texts if text.get_rotation() == 0.0]
    assert not any(one.overlaps(two) for one, two in itertools.combinations(boxes, 2))
    assert sum("frictionless" in text.get_text() for text in axes.texts) == 1
    support = min(text.get_position()[1] for text in axes.texts if "bearing" in text.get_text())
    assert support < -0.03 * 27.0  # below the rollers and the line that carries them
    draw_model(figure := Figure(layout="constrained"), as_posed(load(CONFIGS / "pin.toml")))
    frame = figure.axes[0].get_window_extent()
    assert all(frame.x0 < text.get_window_extent().x0 for text in figure.axes[0].texts)


def test_draw_refuses_what_solve_refuses(tmp_path, capsys):
    config = tmp_path / "own.toml"
    config.write_text((CONFIGS / "hertz.toml").read_text().replace('"top"', '"topp"'))
    assert main(["draw", str(config), "-o", str(tmp_path / "own.png")]) == 2
    assert "did you mean 'top'" in capsys.readouterr().err
    assert main(["draw", str(CONFIGS / "hertz.toml"), "-o", "own.jpg"]) == 2
    assert "own.jpg: a figure is .png, .pdf or .svg" in capsys.readouterr().err
