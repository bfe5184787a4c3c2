"""How a sweep ended, in a few lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

TOLD = 20
"""Failed cases that the summary names."""


@dataclass
class Summary:
    """How a sweep ended.

    Attributes
    ----------
    computed, reused : int
        Cases of this run, and cases that were there.
    failed, not_converged : dict of str to str
        Reasons by case id, of this run and of reused rows.
    seconds : float
        From the first look at the folder to results.h5 on the disk.
    ranks : int
    cpu : list of float
        Processor seconds of each rank in that time; a rank that waits sleeps.
    timings : dict of str to float
        Seconds by stage, summed over teams.
    results : Path
        The table; of a part, the folder of its journals.
    """

    computed: int = 0
    reused: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    not_converged: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    ranks: int = 1
    cpu: list[float] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    results: Path = Path()

    @property
    def exit_status(self) -> int:
        """0 all converged, 3 some not converged, 1 some failed."""
        return 1 if self.failed else 3 if self.not_converged else 0

    def lines(self) -> list[str]:
        """A few lines for the user."""
        total = self.computed + self.reused
        converged = total - len(self.failed) - len(self.not_converged)
        split = ", ".join(f"{name} {seconds:.3f}" for name, seconds in self.timings.items())
        bad = [f"  failed: {id_}: {reason}" for id_, reason in self.failed.items()]
        bad += [f"  not converged: {id_}: {reason}" for id_, reason in self.not_converged.items()]
        if len(bad) > TOLD:
            bad[TOLD:] = [f"  ... and {len(bad) - TOLD} more, see petcontact report"]
        return [
            *bad,
            f"  computed {self.computed}, reused {self.reused}, failed {len(self.failed)}"
            f" ({converged} converged, {len(self.not_converged)} not converged)",
            f"  {self.seconds:.3f} s on {self.ranks} rank{'s' * (self.ranks != 1)}; processor time a rank: mean "
            f"{sum(self.cpu) / max(1, len(self.cpu)):.3f} s, largest {max(self.cpu, default=0.0):.3f} s",
            f"  summed over the ranks [s]: {split}",
            f"  result: {self.results}",
        ]
