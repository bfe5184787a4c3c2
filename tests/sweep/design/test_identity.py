"""What a case is: its digest changes with everything that a digit depends on, and with nothing
else."""

from __future__ import annotations

import json

from sweep_files import CONFIGS, sweep_file

from petcontact import load
from petcontact.sweep.design.identity import Identity, identify
from petcontact.sweep.design.sweep import Sweep, read_sweep

TEXT = """
problems = ["example1.toml"]
{more}
[cross]
rho = {rho}
tau = [1.0, 2.0]
"""


def digests(folder, rho=(1.0, 10.0), more="", **keywords):
    sweep = read_sweep(sweep_file(folder, TEXT.format(rho=list(rho), more=more)))
    identity = identify(sweep, **keywords)
    # a reader has no options, functions or files
    again = Identity(Sweep(*sweep.content), json.loads(json.dumps(identity.facts)))
    assert [again.digest(k) for k in range(len(sweep))] == [
        identity.digest(k) for k in range(len(sweep))
    ]
    return {sweep.ids[k]: identity.digest(k) for k in range(len(sweep))}


def test_every_case_has_its_own_and_more_values_leave_those_that_were_there(tmp_path):
    few, many = digests(tmp_path), digests(tmp_path, rho=(0.5, 1.0, 10.0, 20.0))
    assert len(set(many.values())) == 8
    assert few.items() <= many.items()


def test_it_changes_with_the_problem_the_options_and_what_is_asked_for(tmp_path):
    known = digests(tmp_path)
    other = [
        digests(tmp_path, options={"bem_hodlr_tol": "0.05"}),
        digests(tmp_path, options={"ksp_type": "gmres"}),
        digests(tmp_path, more="[set]\ntolerance = 1e-5\n"),
        digests(tmp_path, more="von_mises = [[1.0, 1.0]]"),
        digests(tmp_path, functions={"slip_work": lambda solution: 0.0}),
    ]
    for found in other:
        assert not set(known.values()) & set(found.values())
    assert (
        digests(tmp_path, options={"ksp_monitor": "", "log_view": "", "options_left": "no"})
        == known
    )


def test_it_changes_with_the_content_of_files(tmp_path):
    mesh, start = tmp_path / "body.msh", tmp_path / "start.h5"
    path = sweep_file(tmp_path, 'problems = ["body.toml"]\n[cross]\nrho = [1.0]\n')
    found = []
    for contents in (("a", "a"), ("b", "a"), ("b", "b")):
        for file, content in zip((mesh, start), contents, strict=True):
            file.write_text(content)
        files = {"geometry": {"shape": "gmsh", "file": str(mesh)}, "method.start": str(start)}
        (tmp_path / "body.toml").write_text(load(CONFIGS / "example1.toml", files).toml())
        found.append(identify(read_sweep(path)).digest(0))
    assert len(set(found)) == 3
