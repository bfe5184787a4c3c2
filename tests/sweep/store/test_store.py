"""Columns, and logs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from petcontact.errors import OutputError
from petcontact.sweep.store import log as module
from petcontact.sweep.store.columns import columns_of, stacked, taken
from petcontact.sweep.store.log import Log, records

VALUES = st.one_of(
    st.none(),
    st.integers(-(2**53), 2**53),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=5),
)


def rows_of(columns):
    lists = {
        name: [v.decode() if isinstance(v, bytes) else v for v in values.tolist()]
        for name, values in columns.items()
    }
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


@given(
    st.lists(
        st.fixed_dictionaries(
            {"a": VALUES, "b": st.integers(-5, 5), "c": st.text("xyµ", max_size=3)}
        ),
        min_size=1,
    )
)
def test_rows_become_columns_and_come_back(rows):
    columns = columns_of(rows)
    for row, back in zip(rows, rows_of(columns), strict=True):
        assert (back["b"], back["c"]) == (row["b"], row["c"])
        if columns["a"].dtype.kind == "S":
            assert back["a"] in (row["a"], "" if row["a"] is None else json.dumps(row["a"]))
        else:
            assert back["a"] == row["a"] or (row["a"] is None and np.isnan(back["a"]))


def test_columns_below_one_another_fill_what_is_missing():
    both = stacked(
        [
            columns_of([row])
            for row in ({"a": 1, "s": "x"}, {"a": 2.5, "t": 3}, {"a": None, "s": "yy"})
        ]
    )
    assert both["s"].tolist() == [b"x", b"", b"yy"]
    np.testing.assert_array_equal(both["a"], [1.0, 2.5, np.nan])
    np.testing.assert_array_equal(both["t"], [np.nan, 3.0, np.nan])
    assert rows_of(taken(both, [2, 0]))[1]["s"] == "x"


@given(st.integers(0, 100_000), st.integers(1, 255))
@example(123, 1)  # the end of the line of a record without fields
def test_of_a_log_that_is_cut_or_altered_the_other_records_stand(tmp_path_factory, at, flip):
    path = tmp_path_factory.mktemp("l") / "a.log"
    fields = [bytes(range(256)) * 2 if k % 3 else b"" for k in range(9)]
    log = Log(path)
    for k in range(9):
        log.add(
            {
                "id": f"case-{k}",
                "status": "converged",
                "rho": 10.0**k,
                "reason": "µ — ü",
                "residual": np.nan,
            },
            fields[k],
        )
        if k == 4:
            log.flush()
    log.flush()
    content = bytearray(path.read_bytes())

    def found():
        return [
            (record.row["id"], record.row["rho"], record.fields())
            for record in records(path, check=True)
        ]

    rows = [(f"case-{k}", 10.0**k, fields[k]) for k in range(9)]
    assert found() == rows and next(records(path)).row["residual"] is None
    at %= len(content)
    ends = [record.at + record.row["bytes"] for record in records(path)]
    path.write_bytes(content[:at])
    assert found() == rows[: sum(end <= at for end in ends)]
    content[at] ^= flip
    path.write_bytes(content)
    assert len(found()) >= 8 and set(found()) <= set(rows)


class Clock:
    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now


@pytest.mark.parametrize(
    "seconds", [[0.01] * 500, [0.3] * 30, [5.0] * 4, [0.01] * 30 + [3.0] + [0.01] * 90]
)
def test_no_more_than_a_second_of_finished_work_is_ever_unwritten(tmp_path, monkeypatch, seconds):
    clock, written = Clock(), []
    monkeypatch.setattr(module, "time", clock)
    log = Log(tmp_path / "a.log", lambda rows, failed: written.append((clock.now, rows)))
    ended: list[float] = []
    for k, cost in enumerate(seconds):
        safe = sum(rows for _, rows in written)
        # a kill in this case would cost what has ended and is not written
        assert sum(seconds[safe : len(ended)]) <= 1.0 + 1e-9
        clock.now += cost
        ended.append(clock.now)
        log.add({"id": str(k), "status": "converged"})
    log.flush()
    assert sum(rows for _, rows in written) == len(seconds)
    assert len(written) <= 2 + 2.5 * sum(seconds) or len(written) <= len(seconds)
    assert [record.row["id"] for record in records(tmp_path / "a.log")] == [
        str(k) for k in range(len(seconds))
    ]


def test_a_log_that_cannot_be_written_says_so(tmp_path):
    log = Log(tmp_path / "no" / "a.log")
    log.add({"id": "x", "status": "converged"})
    with pytest.raises(OutputError, match="the finished cases are whole"):
        log.flush()
