"""Files appear whole under the name that was asked for, and replace nothing that they should
not."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from petcontact.errors import InputError, OutputError
from petcontact.runtime.atomic_write import check_target, temporary_name


def write(path, text, **options):
    with temporary_name(path, **options) as temporary:
        temporary.write_text(text)


@pytest.mark.parametrize("length", [242, 243, 250, 255])
def test_a_name_may_be_as_long_as_the_file_system_allows(tmp_path, length):
    path = tmp_path / ("é" * 100 + "x" * (length - 203) + ".h5")
    assert len(os.fsencode(path.name)) == length
    check_target(path, replace=False)
    write(path, "text")
    assert os.listdir(tmp_path) == [path.name]
    with pytest.raises(InputError, match=f"a name of {length + 14} bytes, 255 are allowed"):
        check_target(path, replace=True, longest=f"{path.stem}-displacement.png")


@pytest.mark.parametrize("kind", ["fifo", "folder", "device", "dangling"])
def test_only_files_are_replaced(tmp_path, kind):
    path = tmp_path / "r.h5"
    make = {
        "fifo": lambda: os.mkfifo(path),
        "folder": path.mkdir,
        "device": lambda: path.symlink_to("/dev/null"),
        "dangling": lambda: path.symlink_to("nowhere"),
    }
    make[kind]()
    with pytest.raises(
        InputError, match=r"r\.h5: is (not a file|a link to nowhere, which is not there)"
    ):
        check_target(path, replace=True)


def test_a_link_is_followed_and_stays(tmp_path):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "real.h5").write_text("old")
    (tmp_path / "r.h5").symlink_to("other/real.h5")
    check_target(tmp_path / "r.h5", replace=True)
    write(tmp_path / "r.h5", "new")
    assert (tmp_path / "r.h5").is_symlink() and (
        tmp_path / "other" / "real.h5"
    ).read_text() == "new"
    assert os.listdir(tmp_path / "other") == ["real.h5"]


def test_what_is_read_is_not_replaced(tmp_path):
    (tmp_path / "c.toml").write_text("title = 'x'")
    os.link(tmp_path / "c.toml", tmp_path / "other.toml")
    for name in ("c.toml", "other.toml"):
        with pytest.raises(InputError, match="is what is read"):
            check_target(tmp_path / name, replace=True, inputs=[tmp_path / "c.toml"])


@pytest.mark.parametrize("linked", [True, False])
def test_who_comes_second_replaces_nothing_and_loses_nothing(tmp_path, monkeypatch, linked):
    """Whoever comes first, the main thread or another."""
    if not linked:

        def refused(*names):
            raise PermissionError(1, "no links here")

        monkeypatch.setattr(os, "link", refused)
    path = tmp_path / "r.h5"
    with ThreadPoolExecutor() as pool:
        pool.submit(write, path, "first", replace=False).result()
    for k in (2, 3):
        with pytest.raises(
            OutputError,
            match=rf"r\.h5: was written by another program meanwhile; .* is in .*r-{k}\.h5$",
        ):
            write(path, f"number {k}", replace=False)
        assert (tmp_path / f"r-{k}.h5").read_text() == f"number {k}"
    assert path.read_text() == "first" and sorted(os.listdir(tmp_path)) == [
        "r-2.h5",
        "r-3.h5",
        "r.h5",
    ]


def test_a_folder_where_nothing_can_be_made_is_told_before_the_work(tmp_path, monkeypatch):
    def full(**words):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    with pytest.raises(
        OutputError, match=r"r\.h5: cannot be written \(No space left on device\)"
    ) as error:
        check_target(tmp_path / "r.h5", replace=False)
    assert error.value.exit_status == 1
