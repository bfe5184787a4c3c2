"""Whole sweeps on one rank: computed, resumed, damaged, refused; the command."""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from sweep_files import CONFIGS, quietly, sweep_file

from petcontact import load_case, load_sweep
from petcontact.errors import InputError, ResultError, SolverError
from petcontact.pipeline import prepare as preparation
from petcontact.pipeline import run as pipeline
from petcontact.pipeline.run import prepare
from petcontact.pipeline.solve import solve
from petcontact.sweep.design.sweep import build_sweep, read_sweep
from petcontact.sweep.design.sweep_file import read_files
from petcontact.sweep.schedule import cost as costs
from petcontact.sweep.schedule.cost import estimate
from petcontact.sweep.schedule.groups import describe
from petcontact.sweep.store import folder as sweep_folder
from petcontact.sweep.store.case_table import read_case_table
from petcontact.sweep.store.folder import SweepFolder

SECONDS = "iterate_seconds"


@pytest.fixture
def small(tmp_path):
    return read_sweep(sweep_file(tmp_path))


def table_of(folder) -> dict:
    """Every row of a sweep by id, without what differs from run to run."""
    table = read_case_table(folder)
    rows = zip(*(table.values(name) for name in table.names), strict=True)
    return {row[0]: {n: v for n, v in zip(table.names, row, strict=True) if n != SECONDS} for row in rows}


# -- plan -----------------------------------------------------------------------------------------------------------


def test_the_plan_knows_the_size_and_memory_of_what_is_assembled(small, comm):
    case = next(c.case for c in small if c.case.mesh.element_size == 0.4)
    cost = estimate(case, 1, 1)
    prepared = prepare(case, comm)
    mesh, data = prepared.operators.mesh, prepared.operators.data
    assert (cost.nodes, cost.contact_unknowns) == (mesh.n_nodes, len(data.contact_nodes))
    n, m = 2 * mesh.n_nodes, len(data.contact_nodes)
    assert 8 * n * n <= cost.memory <= 8 * (n + 2 * m) ** 2
    prepared.close()
    lines = describe(small, [cost], (3, 2, 1, 1), 2, 4)
    assert "3 cases, 2 finished already, 1 to compute in 1 group" in lines[0]
    assert f"{n} unknowns, {m} contact unknowns" in lines[2]


def test_a_body_that_cannot_be_meshed_costs_nothing(small, monkeypatch):
    def refuse(*arguments):
        raise InputError("no mesh")

    monkeypatch.setattr(costs, "mesh_of", refuse)
    cost = estimate(small[0].case, 1, 1)
    assert (cost.nodes, cost.memory) == (0, 0.0)


# -- whole sweeps ---------------------------------------------------------------------------------------------------


def test_a_sweep_computes_each_case_once_and_prepares_each_group_once(small, tmp_path, monkeypatch, comm):
    calls = []
    monkeypatch.setattr(preparation, "prepare", lambda case, comm, cases: calls.append(cases) or prepare(case, comm, cases))
    folder = tmp_path / "new" / "out"
    summary = quietly(small, folder)
    assert (summary.computed, summary.reused, summary.failed, summary.exit_status) == (8, 0, {}, 0)
    assert calls == [4, 4]
    monkeypatch.undo()
    for chosen in small:
        alone, kept = solve(chosen.case, comm=comm), load_case(folder, chosen.id)
        assert kept.iterations == alone.iterations
        np.testing.assert_allclose(kept.contact.sigma_t, alone.contact.sigma_t, rtol=1e-9, atol=1e-9)

    before = table_of(folder)
    again = quietly(small, folder)
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 0)
    assert table_of(folder) == before
    stamp = (folder / "results.h5").stat().st_mtime_ns
    quietly(small, folder, only=["*-h0.4"])
    assert (folder / "results.h5").stat().st_mtime_ns == stamp
    assert quietly(small, folder, force=True, only=["*-h0.4"]).computed == 4
    assert table_of(folder) == before


def test_what_is_left_of_a_group_does_not_decide_how_it_is_computed(small, tmp_path):
    quietly(small, tmp_path / "whole")
    for pattern in ("*modified-rho1e3-h0.4", "*-rho1-*", "*"):
        quietly(small, tmp_path / "bits", only=[pattern])
    assert table_of(tmp_path / "bits") == table_of(tmp_path / "whole")
    for id_ in small.ids:
        a, b = load_case(tmp_path / "bits", id_), load_case(tmp_path / "whole", id_)
        assert np.array_equal(a.contact.u_t, b.contact.u_t) and np.array_equal(a.traction, b.traction)


def test_the_table_is_read_in_one_line_of_h5py_pandas_and_polars(small, tmp_path):
    quietly(small, tmp_path / "out")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        columns = {name: column[()] for name, column in file["cases"].items()}
    assert [id_.decode() for id_ in columns["id"]] == small.ids
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    assert pandas.DataFrame(columns).shape == polars.DataFrame(columns).shape == (8, len(columns))
    frame = load_sweep(tmp_path / "out")
    assert list(frame["id"]) == small.ids and frame["iterations"].dtype == np.int64
    assert set(frame["rule"]) == {"self-adaptive", "modified"}


def test_without_pandas_a_sweep_is_a_dict_of_arrays(small, tmp_path, monkeypatch):
    quietly(small, tmp_path / "out", only=["*-rho1-*"])
    monkeypatch.setitem(sys.modules, "pandas", None)
    columns = load_sweep(tmp_path / "out" / "results.h5")
    assert columns["max_u_t"].shape == (4,) and set(columns["status"]) == {"converged"}


@pytest.mark.parametrize("keep", ["scalars", "contact", "all"])
def test_fields_are_kept_where_they_are_asked_for(tmp_path, keep, comm):
    sweep = read_sweep(sweep_file(tmp_path, keep=keep))
    quietly(sweep, tmp_path / "out")
    shards = list((tmp_path / "out" / "fields").iterdir())
    assert not list((tmp_path / "out" / "journal").iterdir())
    if keep == "scalars":
        assert not shards
        with pytest.raises(ResultError, match="no fields"):
            load_case(tmp_path / "out", sweep.ids[3])
        return
    # several cases a file
    assert 0 < len(shards) < 8
    alone = solve(sweep[3].case, comm=comm)
    kept = load_case(tmp_path / "out", sweep.ids[3])
    found = kept if keep == "contact" else vars(kept.contact)
    np.testing.assert_allclose(found["u_t"], alone.contact.u_t, rtol=1e-9, atol=1e-12)
    assert list(found["part"]) == list(alone.contact.part)
    if keep == "contact":
        assert len(found["history_rho"]) == alone.iterations
    with pytest.raises(ResultError, match="no case"):
        load_case(tmp_path / "out", "nothing")


def test_only_leaves_the_rest_and_the_table_grows(small, tmp_path):
    first = quietly(small, tmp_path / "out", only=["*-rho1-*"])
    assert (first.computed, first.reused) == (4, 0)
    second = quietly(small, tmp_path / "out", only=["*modified*"])
    assert (second.computed, second.reused) == (2, 2)
    with h5py.File(tmp_path / "out" / "results.h5") as results:
        assert len(results["cases/id"]) == 6
    assert read_case_table(tmp_path / "out").status.count("missing") == 2


def test_parts_share_a_folder_and_a_last_run_collects_them(small, tmp_path):
    parts = [quietly(small, tmp_path / "out", part=(k, 3)) for k in (1, 2, 3)]
    assert sum(part.computed for part in parts) == 8
    assert not (tmp_path / "out" / "results.h5").exists()
    assert read_case_table(tmp_path / "out").status == 8 * ["converged"]
    last = quietly(small, tmp_path / "out")
    assert (last.computed, last.reused) == (0, 8)
    quietly(small, tmp_path / "whole")
    assert table_of(tmp_path / "out") == table_of(tmp_path / "whole")


# -- what does not count is computed again ---------------------------------------------------------------------------


def shard_of(folder, id_) -> Path:
    table = read_case_table(folder)
    return folder / "fields" / table.columns["fields"][table.values("id").index(id_)].decode()


@pytest.mark.parametrize("damage", ["truncated", "inverted", "NaN", "deleted group", "external link", "gone", "a folder"])
def test_damaged_fields_are_computed_again(small, tmp_path, damage):
    quietly(small, tmp_path / "out")
    before = table_of(tmp_path / "out")
    path = shard_of(tmp_path / "out", small.ids[5])
    mine = sum(shard_of(tmp_path / "out", id_) == path for id_ in small.ids)
    content = bytearray(path.read_bytes())
    if damage == "truncated":
        path.write_bytes(content[:5000])
    elif damage == "inverted":
        content[6000:6400] = bytes(255 - byte for byte in content[6000:6400])
        path.write_bytes(content)
    elif damage in ("gone", "a folder"):
        path.unlink()
        if damage == "a folder":
            path.mkdir()
    else:
        with h5py.File(path, "a") as file:
            if damage == "NaN":
                file[small.ids[5]]["contact/u_t"][0] = np.nan
            else:
                del file[small.ids[5]]["contact"]
                if damage == "external link":
                    file[small.ids[5]]["contact"] = h5py.ExternalLink("elsewhere.h5", "/contact")
    said = []
    summary = quietly(small, tmp_path / "out", say=said.append)
    assert (summary.computed, summary.reused, summary.exit_status) == (mine, 8 - mine, 0)
    assert any("damaged or missing" in line for line in said)
    assert table_of(tmp_path / "out") == before
    assert all(load_case(tmp_path / "out", id_).converged for id_ in small.ids)


@pytest.mark.parametrize("damage", ["truncated", "inverted", "value", "shape", "no HDF5"])
def test_a_damaged_table_is_computed_again(small, tmp_path, damage):
    quietly(small, tmp_path / "out")
    before = table_of(tmp_path / "out")
    path = tmp_path / "out" / "results.h5"
    content = bytearray(path.read_bytes())
    if damage in ("truncated", "no HDF5"):
        path.write_bytes(content[:3000] if damage == "truncated" else b"something else")
    elif damage == "inverted":
        with h5py.File(path) as file:
            at = file["cases/max_u_t"].id.get_chunk_info(0).byte_offset
        content[at : at + 20] = bytes(255 - byte for byte in content[at : at + 20])
        path.write_bytes(content)
    else:
        with h5py.File(path, "a") as file:
            if damage == "value":
                file["cases/max_u_t"][2] = np.nan
            else:
                del file["cases/max_u_t"]
                file["cases/max_u_t"] = np.zeros(10_000)
    said = []
    summary = quietly(small, tmp_path / "out", say=said.append)
    assert (summary.computed, summary.exit_status) == (8, 0)
    assert any("results.h5" in line and "again" in line for line in said)
    assert table_of(tmp_path / "out") == before


def test_lines_of_a_journal_that_are_torn_or_altered_are_not_there(small, tmp_path):
    for k in (1, 2):
        quietly(small, tmp_path / "out", part=(k, 2))
    journals = sorted((tmp_path / "out" / "journal").iterdir())
    lines = [(path, line) for path in journals for line in path.read_bytes().splitlines(True)]
    assert len(lines) == 8
    path, line = lines[0]
    assert json.loads(line)["status"] == "converged"
    altered = line.replace(b'"iterations": ', b'"iterations": 1')
    rest = b"".join(other for where, other in lines[1:] if where == path)
    path.write_bytes(altered + rest + line[: len(line) // 2])
    last = quietly(small, tmp_path / "out")
    assert (last.computed, last.reused) == (1, 7)


def test_another_tolerance_is_another_case(small, tmp_path):
    quietly(small, tmp_path / "out")
    file, data, problems = read_files(tmp_path / "small.toml")
    data["set"] = {"tolerance": 1e-5}
    said = []
    assert quietly(build_sweep(file, data, problems), tmp_path / "out", say=said.append).computed == 8
    assert any("8 cases are there with another config" in line for line in said)


def test_more_fields_or_quantities_than_are_there_are_computed(tmp_path):
    (tmp_path / "own_quantities.py").write_text(
        "import numpy as np\n\ndef slip_work(solution):\n"
        "    c = solution.contact\n    return float((c.weight * c.friction_bound) @ np.linalg.norm(c.u_t, axis=1))\n"
    )
    text = 'problems = ["example1.toml"]\nkeep = "{keep}"\n{more}\n[cross]\nrho = [1.0, 1e3]\n[set]\nelement_size = 0.4\n'
    counts = []
    more = 'quantities = ["own_quantities:slip_work"]\nvon_mises = [[4.0, 2.0], [1.0, 3.0]]'
    wanted = [("scalars", ""), ("scalars", ""), ("contact", ""), ("scalars", ""), ("contact", more), ("all", more)]
    for keep, extra in wanted:
        sweep = read_sweep(sweep_file(tmp_path, text.format(keep=keep, more=extra)))
        counts.append(quietly(sweep, tmp_path / "out").computed)
    assert counts == [2, 0, 2, 0, 2, 2]
    table = read_case_table(tmp_path / "out")
    assert table.numbers("von_mises_1").min() > 0.0
    # all that slips slips at the bound
    np.testing.assert_allclose(table.numbers("slip_work"), table.numbers("dissipated_energy"), rtol=1e-6)


def test_a_gmsh_mesh_that_changed_is_another_body(tmp_path):
    for name in ("gallery_bracket.toml", "gallery_bracket.msh"):
        (tmp_path / name).write_bytes((CONFIGS / name).read_bytes())
    path = sweep_file(tmp_path, 'problems = ["gallery_bracket.toml"]\n[cross]\ntolerance = [1e-6, 1e-7]\n')
    assert quietly(read_sweep(path), tmp_path / "out").computed == 2
    assert quietly(read_sweep(path), tmp_path / "out").reused == 2
    mesh = tmp_path / "gallery_bracket.msh"
    mesh.write_text(mesh.read_text() + "\n")
    assert quietly(read_sweep(path), tmp_path / "out").computed == 2


# -- failures -------------------------------------------------------------------------------------------------------


def test_a_failing_case_is_recorded_and_redone(small, tmp_path, monkeypatch):
    run = pipeline.run
    errors = {"modified": SolverError("iterate", "made to fail", "nothing"), "self-adaptive": ZeroDivisionError("oh")}

    def failing(prepared, case):
        if case.method.rho == 1e3 and case.mesh.element_size == 0.4:
            raise errors[case.method.rule]
        return run(prepared, case)

    monkeypatch.setattr(pipeline, "run", failing)
    summary = quietly(small, tmp_path / "out")
    assert summary.exit_status == 1
    assert summary.failed == {
        "example1-modified-rho1e3-h0.4": "iterate: made to fail; nothing",
        "example1-self-adaptive-rho1e3-h0.4": "ZeroDivisionError: oh",
    }
    row = table_of(tmp_path / "out")["example1-modified-rho1e3-h0.4"]
    assert (row["status"], row["reason"]) == ("failed", "iterate: made to fail; nothing")
    assert any("failed: example1-modified-rho1e3-h0.4: iterate: made to fail" in line for line in summary.lines())
    monkeypatch.setattr(pipeline, "run", run)
    again = quietly(small, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (2, 6, 0)


def test_a_group_that_cannot_be_prepared_fails_case_by_case(small, tmp_path, monkeypatch):
    def failing(case, comm, cases):
        if case.mesh.element_size == 0.8:
            raise SolverError("factor", "zero pivot", "fix the body")
        return prepare(case, comm, cases)

    monkeypatch.setattr(preparation, "prepare", failing)
    summary = quietly(small, tmp_path)
    assert len(summary.failed) == 4
    assert all(id_.endswith("h0.8") and "zero pivot" in reason for id_, reason in summary.failed.items())


def test_a_quantity_that_raises_fails_its_case_and_no_other(tmp_path):
    (tmp_path / "raising_quantity.py").write_text("def bad(solution):\n    return 1.0 / (solution.case.method.rho - 1.0)\n")
    text = 'problems = ["example1.toml"]\nquantities = ["raising_quantity:bad"]\n[cross]\nrho = [1.0, 3.0]\n'
    summary = quietly(read_sweep(sweep_file(tmp_path, text)), tmp_path / "out")
    assert list(summary.failed) == ["example1-rho1"] and "ZeroDivisionError" in summary.failed["example1-rho1"]
    with pytest.raises(InputError, match="cannot be imported"):
        quietly(read_sweep(sweep_file(tmp_path, text.replace("raising_quantity", "no_such_module"))), tmp_path / "other")


def test_a_case_that_does_not_converge_ends_with_status_3_and_is_kept(tmp_path):
    sweep = read_sweep(sweep_file(tmp_path, limit=30))
    summary = quietly(sweep, tmp_path / "out")
    assert summary.exit_status == 3
    assert 0 < len(summary.not_converged) < 8
    assert "max_iterations = 30" in next(iter(summary.not_converged.values()))
    again = quietly(sweep, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 3)


def test_a_case_of_a_large_sweep_that_is_invalid_fails_in_its_turn(tmp_path, monkeypatch):
    from petcontact.sweep.design import sweep as module

    monkeypatch.setattr(module, "VALIDATED", 2)
    text = 'problems = ["example1.toml"]\n[cross]\nrho = [1.0, -1.0, 2.0]\n[set]\nelement_size = 0.4\n'
    summary = quietly(read_sweep(sweep_file(tmp_path, text)), tmp_path / "out")
    assert list(summary.failed) == ["example1-rho-1"] and "method.rho" in summary.failed["example1-rho-1"]


# -- the folder -----------------------------------------------------------------------------------------------------


def test_leftovers_of_a_killed_run_are_removed(small, tmp_path):
    folder = tmp_path / "out"
    (folder / "fields").mkdir(parents=True)
    leftovers = [folder / "fields" / ".petcontact-x7.tmp", folder / ".petcontact-y.tmp", folder / ".running"]
    for path in leftovers:
        path.write_text("")                                 # .running, too: a file in the place of a folder
    assert quietly(small, folder).computed == 8
    assert not any(path.exists() for path in leftovers)


def test_another_sweep_is_refused_without_force(small, tmp_path):
    quietly(small, tmp_path / "out")
    before = {path: path.read_bytes() for path in (tmp_path / "out").glob("*.*")}
    other = read_sweep(sweep_file(tmp_path, 'problems = ["example2.toml"]\n[cross]\nelement_size = [0.4]', "other.toml"))
    with pytest.raises(InputError, match=r"holds another sweep \(8 of its 8 cases") as caught:
        quietly(other, tmp_path / "out")
    assert "\n" not in str(caught.value)
    assert {path: path.read_bytes() for path in before} == before
    assert quietly(other, tmp_path / "out", force=True).computed == 1
    assert list(table_of(tmp_path / "out")) == other.ids


def test_a_sweep_that_grows_keeps_what_is_there(small, tmp_path):
    quietly(small, tmp_path / "out")
    file, data, problems = read_files(tmp_path / "small.toml")
    data["cross"]["rho"] = [1.0, 1e3, 1e5]
    summary = quietly(build_sweep(file, data, problems), tmp_path / "out")
    assert (summary.computed, summary.reused) == (4, 8)


def test_two_sweeps_do_not_share_a_folder(small, tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_folder, "LOCK_PATIENCE", 0.2)
    folder = SweepFolder(tmp_path)
    folder.open()
    for part in (None, (1, 2)):
        with pytest.raises(InputError, match="another sweep"):
            quietly(small, tmp_path, part=part)
    folder.close()
    part = SweepFolder(tmp_path, (1, 2))
    part.open()
    with pytest.raises(InputError, match="another sweep"):
        quietly(small, tmp_path)
    quietly(small, tmp_path, part=(2, 2))
    part.close()
    assert quietly(small, tmp_path).exit_status == 0
    with open(tmp_path / ".lock") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@pytest.mark.parametrize("name", ["results.h5", "sweep.json"])
def test_a_folder_in_the_place_of_a_file_is_refused(small, tmp_path, name):
    (tmp_path / "out" / name).mkdir(parents=True)
    with pytest.raises(InputError, match=r"no folders|not the index"):
        quietly(small, tmp_path / "out")


def test_a_folder_that_cannot_be_made(small, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file/out"):
        quietly(small, tmp_path / "file" / "out")


# -- command line ---------------------------------------------------------------------------------------------------


def command(*words: str, cwd: Path) -> subprocess.CompletedProcess:
    root = Path(__file__).parents[2]
    return subprocess.run([sys.executable, "-m", "petcontact", "sweep", *words], cwd=cwd, capture_output=True, text=True,
                          timeout=120, env={**os.environ, "PYTHONPATH": str(root)})  # fmt: skip


def test_the_command_lists_computes_and_says_what_it_did(tmp_path):
    sweep_file(tmp_path)
    listed = command("small.toml", "--list", "--only", "*-h0.8", cwd=tmp_path)
    assert listed.returncode == 0
    assert len(listed.stdout.splitlines()) == 4
    assert not (tmp_path / "small").exists()
    done = command("small.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "8 cases, 0 finished already, 8 to compute in 2 groups" in done.stdout
    assert "computed 8, reused 0, failed 0" in done.stdout
    assert "\r" not in done.stdout + done.stderr
    assert (tmp_path / "small" / "results.h5").exists()
    for words in (("--only", "nothing"), ("--ranks-per-case", "2"), ("--part", "3/2")):
        bad = command("small.toml", *words, cwd=tmp_path)
        assert (bad.returncode, bad.stderr.count("\n")) == (2, 1)
    # options that change digits are another case
    redone = command("small.toml", "-ksp_type", "gmres", "-ksp_rtol", "1e-10", cwd=tmp_path)
    assert "computed 8, reused 0" in redone.stdout


def test_results_that_do_not_fit_the_disk_end_in_one_line_and_lose_no_case(small, tmp_path):
    """A limit on the size of a file stands for a full disk: journals and shards fit it, the table does not."""
    sweep = read_sweep(sweep_file(tmp_path, keep="scalars"))
    program = (
        "import resource, sys\nfrom petcontact.commands import main as cli\n"
        "from petcontact.runtime.petsc import initialise\n"
        "initialise()\nresource.setrlimit(resource.RLIMIT_FSIZE, (15_000, 15_000))\n"
        "sys.argv[0] = 'petcontact'\ncli.entry()\n"
    )
    words = [sys.executable, "-c", program, "sweep", str(tmp_path / "small.toml"), "-o", str(tmp_path / "out")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("petcontact:")]
    assert "results.h5: cannot be written (File too large); the finished cases are whole" in line
    assert not (tmp_path / "out" / "results.h5").exists() and not list((tmp_path / "out").glob("*.tmp"))
    assert read_case_table(tmp_path / "out").status == 8 * ["converged"]
    again = quietly(sweep, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 0)
