"""PETSc's options: a config chooses solvers and no more; what PETSc would end the process over is
refused before."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from petcontact.errors import InputError
from petcontact.model.case import load
from petcontact.runtime.petsc_options import check, of_files, refused_in_config

CONFIG = Path(__file__).parents[2] / "configs/example1.toml"
SOLVERS = """
ksp_type fgmres
elastic_pc_type lu
ksp_atol 1.5e-12
mg_levels_ksp_chebyshev_esteig 0,0.1,0,1.1
pc_factor_mat_solver_type superlu_dist
mat_mumps_icntl_14 80
bem_mat_type hodlr
ksp_view ::ascii_info_detail
no_such_option 7
"""
CODE = """
pc_type python
ksp_type Python
sub_ksp_type python
pc_python_type os.system
pc_composite_pcs lu,python
dll_append evil.so
ksp_guess_type evil.so:f
pc_shell_library evil
start_in_debugger gdb
"""
FILES = """
ksp_view :problem.toml
Elastic_KSP_Monitor ascii:f
ksp_view_rhs binary
ksp_view_eigenvalues draw
vec_view vtk:f
ksp_view_final_residual ::ascii_info,:f
tao_gmonitor f
log_view :f
history f
citations f
options_file f
saws_port 80
display host:0
mat_mumps_ooc_tmpdir x
some_filename f
petsc_sleep 100
"""
SHAPES = """
ksp_type gmres -pc_type python
pc_type ../x
ksp_rtol 1e-8;
ksp_atol $HOME
mat_something config.toml
elastic_ksp_gmres_restart 100000000
"""
VALUES = {
    "python": "",
    "mpi_linear_solver_server": "",
    "fp_trap": True,
    "tao_monitor": True,
    "options_string": "-pc_type python",
    "memory_view": "",
    "pc_factor_mat_ordering_type": "nd\n",
    "ksp_gmres_restart": 100000000,
}
"""Those whose value is no word."""


def pairs(text):
    return [line.split(" ", 1) for line in text.strip().splitlines()]


def test_a_config_chooses_solvers_and_prints():
    numbers = {"ksp_rtol": 1e-8, "ksp_max_it": 10000, "ksp_monitor": "", "tao_monitor": ""}
    assert refused_in_config(dict(pairs(SOLVERS)) | numbers | {"ksp_converged_reason": True}) == ""


@pytest.mark.parametrize(
    ("name", "value"), [*pairs(CODE + FILES[1:] + SHAPES[1:]), *VALUES.items()]
)
def test_a_config_runs_no_code_and_writes_no_file(name, value):
    assert refused_in_config({"ksp_type": "gmres", name: value}).startswith(f"{name} = ")


def test_the_file_and_the_key_are_named():
    refused = r"example1\.toml: petsc: pc_type = 'python': a config runs no code; -pc_type on the"
    with pytest.raises(InputError, match=refused):
        load(CONFIG, {"petsc.pc_type": "python"})


@given(
    st.text("abcdefgh_.0/:", max_size=12),
    st.sampled_from(["", "elastic_", "sub_", "mg_levels_1_"]),
    st.text(max_size=9),
)
def test_no_value_with_a_separator_of_files_is_accepted(name, prefix, value):
    """Whatever the option is called: a path has a slash, a viewer's file follows a colon."""
    for mark in ("/", ":x", "\\"):
        assert refused_in_config({f"{prefix}a{name}": f"{value}{mark}{value}"})


def test_options_files_are_read_as_petsc_would(tmp_path):
    good, bad, binary, inner = (tmp_path / name for name in ("good", "bad", "binary", "inner"))
    good.write_text(
        f"# a comment\n\n-ksp_type gmres # more\n% and this\n-options_file {inner}\n"
        "alias -a -ksp_rtol\n-ksp_rtol -1e-3\n"
    )
    inner.write_text("-ksp_view\n")
    check(["-options_file", str(good)])
    inner.write_text(f"-ksp_monitor :{tmp_path}/none/f\n")
    bad.write_text("-ksp_type gmres\nksp_rtol = 1e-8\n")
    binary.write_bytes(b"\0\1")
    told = {
        good: "none/f cannot be written",
        bad: "line 2 begins with 'ksp_rtol'",
        binary: "not a text file",
        tmp_path: "is a folder",
    }
    for file, text in told.items():
        with pytest.raises(InputError, match=text):
            check(["-options_file", str(file)])


@pytest.mark.parametrize(
    "words",
    [
        "-python",
        "-fp_trap",
        "-fp_trap on",
        "-ksp_gmres_restart 100000000",
        "-log_view :{folder}/none/x",
        "-history {folder}/none/x",
        "-ksp_view ascii:/",
        "-options_file",
    ],
)
def test_what_petsc_would_end_the_process_over_is_refused(words, tmp_path):
    with pytest.raises(InputError, match=f"^{words.split()[0]}"):
        check(words.format(folder=tmp_path).split())


def test_the_command_line_is_the_users(tmp_path):
    words = "-pc_type python -ksp_view :{}/view -fp_trap 0 -ksp_gmres_restart 200 -info"
    check(words.format(tmp_path).split())


@pytest.mark.parametrize("name", [".petscrc", "petscrc"])
@pytest.mark.parametrize(
    "line",
    [
        "-python ./x.sh",
        "-ksp_rtol 1e-8 -pc_python_type evil.P",
        "-options_file .petscrc",
        "alias -ksp_view -python",
        "hello world",
    ],
)
def test_a_file_of_the_working_folder_is_data(tmp_path, monkeypatch, name, line):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / name).write_text(f"# of a stranger\n{line}\n")
    with pytest.raises(InputError, match=rf"^{re.escape(name)}: "):
        of_files()


def test_files_of_options_that_choose_solvers_are_taken(tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / ".petscrc").write_text("-ksp_rtol '1e-8' # mine\n-log_view\n")
    (tmp_path / "home/.petscrc").write_text("-log_view :mine\n")
    home = ["-options_file", str(tmp_path / "home/.petscrc")]
    assert of_files() == [*home, "-ksp_rtol", "1e-8", "-log_view"]
