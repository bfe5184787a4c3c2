"""Signals that come where Python cannot pass an exception on."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import os, signal
from petcontact.runtime import signals

class Collected:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(10): pass  # where the handler runs

signals.install()
Collected()
try:
    with signals.deferred():
        print("works on")
except signals.Interrupted as interrupted:
    print(interrupted)
"""


def test_a_signal_while_rubbish_is_collected_is_not_lost():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0 and done.stderr == ""
    assert done.stdout.splitlines() == ["works on", "SIGTERM; nothing was written"]
