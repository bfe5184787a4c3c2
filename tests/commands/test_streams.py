"""Standard streams that are closed, full, without a reader or not made for the text; texts that are
not made for them."""

from __future__ import annotations

import csv
import io
import os
import shlex
import subprocess
from pathlib import Path

import forked
import pytest

from petcontact.runtime.terminal import StatusLine, printable
from petcontact.runtime.text_table import aligned, as_csv

ROOT = Path(__file__).parents[2]
COARSE = "--force --set mesh.element_size=0.5"
EVIL = "$\\frac{$ \u001b[31mred\n second line é"


def shell(folder, line, **environment):
    """A line of bash in which `petcontact` is ours."""
    program = f'petcontact() {{ {shlex.quote(forked.program())} "$@"; }}; {line}'
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", program],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PYTHONPATH": path} | environment,
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "c.toml").write_text((ROOT / "configs" / "example1.toml").read_text())
    return tmp_path


@pytest.mark.parametrize(
    ("redirected", "said"),
    [
        ("<&- >&- 2>&-", ""),
        (
            ">/dev/full",
            "petcontact: standard output: cannot be written (No space left on device)\n",
        ),
    ],
)
def test_a_solve_that_nobody_hears_is_a_solve(folder, redirected, said):
    done = shell(folder, f"petcontact solve c.toml --no-figures {COARSE} {redirected}")
    assert done.returncode == 0 and done.stderr == said
    assert (folder / "c.h5").read_bytes()[:4] == b"\x89HDF"


def test_a_report_that_cannot_be_written_is_a_failure(folder):
    """What is printed is all that `doctor` is for."""
    done = shell(folder, "petcontact doctor > /dev/full")
    assert done.returncode == 1
    assert (
        done.stderr == "petcontact: standard output: cannot be written (No space left on device)\n"
    )


def test_a_title_of_any_characters_is_printed_on_one_line_and_drawn(folder):
    """Formulas that are none, escape sequences, line ends, letters that the stream has not."""
    (folder / "c.toml").write_text(
        (folder / "c.toml").read_text().replace('title = "', f"title = {toml(EVIL)} # ")
    )
    more = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = shell(folder, f"petcontact solve c.toml {COARSE}", **more)
    assert done.returncode == 0 and done.stderr == ""
    first, second = done.stdout.splitlines()[:2]
    assert first == "converged: $\\frac{$ \\x1b[31mred\\n second line \\xe9"
    assert second.startswith("  bottom: bilateral contact")
    assert len(list(folder.glob("*.png"))) == 3


def toml(text):
    escaped = "".join(f"\\u{ord(c):04x}" if not c.isprintable() or c in '\\"' else c for c in text)
    return f'"{escaped}"'


def test_an_error_names_a_file_in_one_line_whatever_its_name(folder):
    done = shell(folder, r"petcontact solve $'a\nb\033[2J.toml'")
    assert done.returncode == 2
    assert (
        done.stderr == "petcontact: a b\\x1b[2J.toml: cannot be read (No such file or directory)\n"
    )


@pytest.mark.parametrize("text", ["=1+1", "-x", "\t=1", "a,b", 'say "x"', "two\nlines", "plain"])
def test_csv_cells_are_no_formulas(text):
    ((_, cell, number, empty),) = list(
        csv.reader(io.StringIO(as_csv(["a", "b", "c", "d"], [["x", text, -1.5, None]])))
    )[1:]
    assert cell.lstrip("'") == printable(text) and cell.isprintable() and cell[0] not in "=+-@"
    assert (number, empty) == ("-1.5", "")


def test_words_of_a_table_stay_in_their_cells():
    lines = aligned([["a", "b"], ["x|y\n\x1b[1m", "z"]])
    assert len(lines) == 3 and lines[2] == "| x\\|y\\n\\x1b[1m |   z |"


# --- PETSc's files
# --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("-options_file a.opt", "-options_file a.opt: includes itself"),
        ("-options_file b.opt", "-options_file none.opt: no such file"),
        (
            "-log_view :{folder}/none/x",
            "-log_view :{folder}/none/x: {folder}/none/x cannot be written",
        ),
        ("-ksp_view ascii:{folder}", "cannot be written"),
    ],
)
def test_petsc_files_that_cannot_be(folder, words, said):
    (folder / "a.opt").write_text("-ksp_type gmres\n# -options_file none\n-options_file c.opt\n")
    (folder / "c.opt").write_text("-options_file a.opt\n")
    (folder / "b.opt").write_text("-options_file none.opt\n")
    done = shell(
        folder, f"petcontact solve c.toml --no-figures {COARSE} {words.format(folder=folder)}"
    )
    assert done.returncode == 2 and said.format(folder=folder) in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (folder / "c.h5").exists()


def test_long_work_off_a_terminal_says_how_far_it_is(monkeypatch, capsys):
    """A line after 3 s of processor time and one after 30, and none on other ranks."""
    spent = iter([0.0, 1.0, 3.5, 5.0, 31.0, 0.0, 100.0])
    monkeypatch.setattr("petcontact.runtime.terminal.processor_time", lambda: next(spent))
    line = StatusLine(False, elsewhere=True)
    for share in (1, 4, 5, 31):
        line.show(f"{share} of 100")
    StatusLine(False).show("another rank")
    assert capsys.readouterr().err == "petcontact: 4 of 100, 4 s\npetcontact: 31 of 100, 31 s\n"
