"""Options that would do nothing in the company they are given in: one line, before any file is
read."""

from __future__ import annotations

import pytest
from examples import example

from petcontact import MeshOptions, solve
from petcontact.commands.main import main

pytestmark = pytest.mark.usefixtures("unsampled")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("solve no.toml --figures out --no-figures", "--figures: --no-figures draws nothing"),
        ("plot no.h5 --animate a.gif -o out", "--figures: is not used by --animate"),
        ("plot no.h5 --animate a.gif --format pdf", "--format: is not used by --animate"),
        ("plot no.h5 --animate a.gif --html", "--html: is not used by --animate"),
        ("plot no.h5 --html --format pdf", "--format: is not used by --html"),
        ("export no.h5 --vtkhdf a.vtkhdf --table pairs", "--table: is of --csv"),
        ("export no.h5 --vtkhdf a.vtkhdf --step 1", "--step: is of --csv"),
        ("export no.h5 --csv out --grid 8x8", "--grid: is of --vtkhdf"),
        ("export no.h5 --csv out --body lower", "--body: is of --superelement"),
        ("report no --figures out", "--figures: is the folder of --plot"),
        (
            "init a --kind gmsh --from part.inp",
            "--kind is a starter's, --from takes the problem from a file",
        ),
    ],
)
def test_an_option_that_nothing_reads_is_refused(words, message, capsys):
    assert main(words.split()) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1


def test_petsc_options_that_nothing_uses_are_named_in_python():
    problem = example(1, mesh=MeshOptions(element_size=0.8))
    with pytest.warns(UserWarning, match=r"petsc_options that nothing used: nix, -ksp_type"):
        solve(
            problem,
            petsc_options={"ksp_type": "gmres", "pc_type": "jacobi", "nix": 1, "-ksp_type": "cg"},
        )
