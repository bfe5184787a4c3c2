"""Folders of format 1 are read, and go on as folders of today."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pytest
from sweep_files import quietly, sweep_file

from petcontact.pipeline.run import prepare, run
from petcontact.results.hdf5 import write_group, write_solution
from petcontact.sweep.design.sweep import read_sweep
from petcontact.sweep.store.case_table import read_case_table
from petcontact.sweep.store.format1 import sound


@pytest.fixture
def old(tmp_path, comm):
    """A folder as version 0.1 wrote it: case files, their copies in results.h5, ids and coordinates in sweep.json."""
    sweep = read_sweep(sweep_file(tmp_path))
    folder = tmp_path / "out"
    (folder / "cases").mkdir(parents=True)
    entries = [{"id": case.id, "coordinates": case.coordinates} for case in sweep]
    index = json.dumps({"format": "petcontact sweep", "version": 1, "title": "old", "cases": entries})
    (folder / "sweep.json").write_text(index)
    prepared = {}
    with h5py.File(folder / "results.h5", "w") as file:
        file.attrs.update({"format": "petcontact sweep", "format_version": 1, "title": "old"})
        file[".index"] = index
        for case in sweep:
            h = case.case.mesh.element_size
            prepared.setdefault(h, prepare(case.case, comm, 4))
            solution = run(prepared[h], case.case)
            write_solution(folder / "cases" / f"{case.id}.h5", solution)
            write_group(file.create_group(case.id), solution)
    for some in prepared.values():
        some.close()
    return sweep, folder


def test_folder_and_results_file_are_read(old):
    sweep, folder = old
    tables = [read_case_table(path) for path in (folder, folder / "results.h5")]
    for table in tables:
        assert table.title == "old" and table.values("id") == sweep.ids and table.status == 8 * ["converged"]
        assert table.coordinates == sweep.coordinate_names
        assert table.solution(3).case == sweep[3].case
    assert tables[0].values("iterations") == tables[1].values("iterations")


def test_it_goes_on_with_what_is_whole(old):
    sweep, folder = old
    cases = [folder / "cases" / f"{id_}.h5" for id_ in sweep.ids]
    with h5py.File(cases[0], "a") as file:
        file["contact/u_t"][0] = np.nan
    with h5py.File(cases[1], "a") as file:
        del file["contact"]
    with h5py.File(cases[2], "a") as file:
        del file["contact/sigma_n"]
        file["contact/sigma_n"] = np.zeros(3)
    with h5py.File(cases[3], "a") as file:
        del file.attrs["reason"]
    cases[4].unlink()
    cases[4].mkdir()
    with h5py.File(cases[5], "a") as file:
        file.attrs["status"] = "failed"
    before = read_case_table(folder / "results.h5").values("iterations")
    summary = quietly(sweep, folder)
    assert (summary.computed, summary.reused, summary.exit_status) == (6, 2, 0)
    table = read_case_table(folder)
    assert table.values("iterations") == before and table.status == 8 * ["converged"]
    assert table.numbers("max_u_t").min() > 0.0
    again = quietly(sweep, folder)
    assert (again.computed, again.reused) == (0, 8)
    # a file of format 1 that is used again is looked at every time
    assert sound(table.solution(7))
    cases[7].write_bytes(cases[7].read_bytes()[:4000])
    assert quietly(sweep, folder).computed == 1
