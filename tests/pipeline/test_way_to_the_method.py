"""From `solve` to the paper's Algorithm 1 a reader passes few calls, in files whose names say what
they do."""

from __future__ import annotations

import traceback
from pathlib import Path

from petcontact import solve
from petcontact.contact.methods.registry import method_of

CONFIG = Path(__file__).parents[2] / "configs" / "example1.toml"


def test_from_solve_to_algorithm_1_there_are_six_calls():
    ways = list[list[str]]()

    def method(system, law, iteration):
        ways.append([Path(frame.filename).stem for frame in traceback.extract_stack()])
        return method_of("semismooth-newton")(system, law, iteration)

    solve(CONFIG, method=method)
    way = ways[0]
    calls = way[way.index("solve") :]
    assert len(calls) - 1 <= 6
    assert list(dict.fromkeys(calls[:-1])) == ["solve", "run", "step_loop", "increment"]
