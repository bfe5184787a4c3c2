"""Counters in files, by threads of one process and by several processes; the ranks of an MPI are in mpi/."""

from __future__ import annotations

import subprocess
import sys
import threading

from petcontact.sweep.progress import Progress
from petcontact.sweep.schedule.counters import Counts, FileCounters

PROCESS = """
import sys
from pathlib import Path
from petcontact.sweep.schedule.counters import FileCounters
counters = FileCounters(Path(sys.argv[1]))
print(*[counters.next() for _ in range(500)])
"""


def test_every_number_is_given_once(tmp_path):
    counters = FileCounters(tmp_path)
    won: list[int] = []
    words = [sys.executable, "-c", PROCESS, str(tmp_path)]
    jobs = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    threads = [threading.Thread(target=lambda: won.extend(counters.next() for _ in range(200))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for job in jobs:
        won.extend(map(int, job.communicate(timeout=60)[0].split()))
    assert sorted(won) == list(range(1800))
    assert counters.look().claimed == 1800


def test_the_progress_line_counts_what_is_on_the_disk(tmp_path):
    counters = FileCounters(tmp_path)
    progress = Progress(counters, 8, enabled=False)
    assert progress.line(1.0) == "0 of 8 cases done, 0 failed"
    counters.add(2, 1)
    assert counters.look() == Counts(0, 2, 1)
    assert progress.line(10.0) == "2 of 8 cases done, 1 failed, 30 s left"
    assert progress.line(3600.0).endswith("3 h 00 min left")
