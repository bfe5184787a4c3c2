"""Problems that cannot be posed are refused in one line that names the key: bodies that touch
nothing, vectors of another dimension, pairs that are stated twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from petcontact import Displacement, InputError, load, solve
from petcontact.commands.options import overrides

CONFIGS = Path(__file__).parents[2] / "configs"
PUSHED = '{body="upper", part="top", value=[0, 1]}'
DRAGGED = '{name="sphere", displacement=[0, 0, 0]}'
REFUSED = [
    ("space_sphere", ["obstacle.0.rotation=0.1"], "rotation: needs 3 components here, got 0.1"),
    ("space_sphere", ["obstacle.0.centre=[0.0, 0.0]"], "centre: needs 3 components"),
    ("space_sphere", ["contact.0.direction=[0, 1]"], "contact[0].direction: the body has 3 dim"),
    ("space_sphere", ["contact.0.direction=[0, 0.6, -0.8]"], "must point out of part 'top'"),
    ("space_sphere", ["contact.0.gap=s"], "unknown name 's'"),
    ("space_sphere", ["contact.0.friction_coefficient=z - 1"], "must be >= 0, is -1 at x = "),
    ("space_sphere", ["contact=[]", "step=[]"], "obstacle 'sphere': no part is in contact"),
    ("stack", ["contact.0.gap=-9.0"], "overlaps by 9, "),
    ("stack", ["contact.0.gap=0.1 if x > 0 else 0"], "contact[0].gap: only numbers, names"),
    ("stack", ["contact.0.friction_coefficient=0,2"], "has a decimal point, not a comma: 0.2"),
    ("stack", ["method.start=none.h5"], "method.start: 'none.h5' is on one mesh, and an adaptive"),
    ("stack", ["body.1.geometry.upper_right=[4e5, 2]"], "give more than 1e+06 nodes"),
    # adaptive meshes look at gaps and at parts that face one another before there is a mesh
    ("stack", ['contact.0.primary="base.hole"'], "contact[0].primary: body 'base': no part"),
    ("stack", ["contact.0.gap=x - z"], "contact[0].gap: unknown name 'z'"),
    ("space_stack", ["body.0.boundary.0.value=[0, 0]"], "(bottom).value: the body has 3 dim"),
    ("space_stack", ["step.1.boundary.0.value=[0.1, 0.2]"], "step[1].boundary[0].value: the bo"),
    ("space_sphere", ["step.1.obstacle.0.displacement=[0, 1]"], "components here, got 2"),
    ("space_stack", ["body.1.mesh.levels=3"], "mesh.levels: is for plane bodies"),
    ("space_stack", ["body.0.mesh.accuracy=0.01"], "mesh.accuracy: is for adaptive meshes"),
    (
        "space_stack",
        ['body.1.geometry={shape="rectangle", lower_left=[0, 0], upper_right=[1, 1]}'],
        "has 2 dimensions",
    ),
    (
        "space_stack",
        ["body.1.point_force=[{at=[1.0, 1.0], force=[0, 0, 1]}]"],
        "at: the body has 3 dimensions",
    ),
    (
        "space_stack",
        ["body.0.point_force=[{at=[0.5, 0.5, 0.2], force=[0, 0, 1]}]"],
        "does not lie inside the body",
    ),
    ("stack", ["body.1.point_force=[{at=[1, 0], force=[1, 1]}]"], "does not lie inside the body"),
    ("stack", ["step.1.boundary=[{part='top', value=[0, 1]}]"], "body: this key is required"),
    (
        "stack",
        [f"step.1.boundary=[{PUSHED}, {PUSHED}]"],
        "is changed twice in this step",
    ),
    (
        "space_sphere",
        [f"step.1.obstacle=[{DRAGGED}, {DRAGGED}]"],
        "is changed twice in this step",
    ),
    (
        "stack",
        ["contact.1={name='again', secondary='base.top', primary='block.bottom'}"],
        "are in contact already, as 'lower'",
    ),
    (
        "hertz",
        ["boundary.0.value=[0, 'free']", "step=[{boundary=[{part='bottom', traction=[1, 0]}]}]"],
        "step[0].boundary[0].traction[0]: must be 0 where",
    ),
    ("hertz", ["boundary.3={part='left', condition='periodic', partner='rigth'}"], "mean 'right'"),
    (
        "hertz",
        ["boundary.3={part='left', condition='periodic', partner='right'}"],
        "'right' of the body has a boundary condition already",
    ),
    (
        "stack",
        ["body.2.boundary=[{part='left', condition='periodic', partner='top'}]", "step=[]"],
        "part 'top' is not part 'left' moved along",
    ),
    (
        "stack",
        [
            "body.1.boundary=[{part='left', condition='periodic', partner='right'}]",
            "step=[{boundary=[{body='block', part='left', value=['x', 0]}]}]",
        ],
        "is periodic, give its jump, two numbers",
    ),
    (
        "space_stack",
        ["body.0.boundary=[{part='left', condition='periodic', partner='right'}]"],
        "periodic sides are those of plane bodies",
    ),
    ("axial_press_fit", ["bem.mat_type=hodlr"], "compresses boundaries of plane bodies; choose"),
    ("axial_torque", ["bem.mat_type=hodlr"], "compresses boundaries of plane bodies; choose"),
    (
        "axial_torque",
        ["method.formulation=full", "method.rule=modified"],
        '"full" is the paper\'s, for one body that is',
    ),
    (
        "space_sphere",
        ["body.0.geometry={shape='sphere', centre=[0, 0, 0], radius=1e-200}"],
        "too little for 16 digits",
    ),
    (
        "space_sphere",
        ["body.0.geometry={shape='sphere', centre=[1e18, 0, 0], radius=1.0}"],
        "too little for 16 digits",
    ),
]


@pytest.mark.parametrize(("config", "changes", "said"), REFUSED)
def test_what_cannot_be_posed_is_refused_in_one_line(config, changes, said):
    with pytest.raises(InputError) as caught:
        solve(load(CONFIGS / f"{config}.toml", overrides(changes)))
    assert said in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("traction", "said"),
    [((1, 2), r"traction\[0\]: must be 0 where"), ((0, 0, 2), "as many components as value, 2")],
)
def test_tractions_of_components_that_are_held_are_refused(traction, said):
    with pytest.raises(InputError, match=said):
        Displacement("top", (0, "free"), traction)
