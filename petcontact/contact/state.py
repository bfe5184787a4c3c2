"""The result of a method: the iterates on Γ_C, and one row of history for each iteration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array, States
from .friction_law import lengths
from .law_protocol import ContactLaw

COLUMNS = ("rho", "w", "change", "residual", "ksp_iterations")


@dataclass
class History:
    """One row for each iteration.

    Attributes
    ----------
    rho, w : list of float
        ρ_k of the Robin step and w_k after it [stress/length]; the largest one if a law has
        several.
    change : list of float
        The quantity of the stopping criterion [-].
    residual : list of float
        ‖R_ρ‖ in L2(Γ_C) of the iterate from which the step starts [stress · length^½].
    ksp_iterations : list of int
    exchanged : list of int
        Nodes on the wrong piece after each step of semismooth Newton; these steps are the last
        rows.
    """

    rho: list[float] = field(default_factory=list)
    w: list[float] = field(default_factory=list)
    change: list[float] = field(default_factory=list)
    residual: list[float] = field(default_factory=list)
    ksp_iterations: list[int] = field(default_factory=list)
    exchanged: list[int] = field(default_factory=list)

    def add(
        self,
        rho: float | Array,
        w: float | Array,
        change: float,
        residual: float,
        ksp_iterations: int,
    ) -> None:
        """Append the row of one iteration."""
        self.rho.append(rho if isinstance(rho, float) else max(rho.tolist()))
        self.w.append(w if isinstance(w, float) else float(w.max()))
        self.change.append(change)
        self.residual.append(residual)
        self.ksp_iterations.append(ksp_iterations)

    def extend(self, later: History) -> None:
        """Append the rows of another method that continued from here."""
        for name in COLUMNS:
            getattr(self, name).extend(getattr(later, name))
        self.exchanged = later.exchanged

    def left(self, tolerance: float) -> float:
        """Return the share of the largest number that a run leaves as its error, at the tolerance
        of changes [-]; steps of Newton's method leave round-off only."""
        return 0.0 if self.exchanged or not self.rho else tolerance

    def __len__(self) -> int:
        return len(self.rho)


@dataclass
class ContactState:
    """The last iterate of a method on Γ_C, and how the method ended.

    Attributes
    ----------
    v, sigma : (m, k) arrays
        Last iterate [length], [stress].
    rho : float or (k,) array
        Robin parameter of the last step [stress/length].
    converged : bool
    reason : str
        Why the method stopped, in words.
    history : History
    stopped : bool
        Whether the monitor or an error ended it.
    error : bool
        Whether an error ended it.
    law : ContactLaw, optional
    alpha : (r,) array
        Amplitudes of the rigid motions that only contact holds.
    where : str
        Step and load factor, in a problem with steps.
    direct : bool
        Whether iterations on S failed, so that a dense S was used.
    unheld : bool
        Whether it ended because the loads move a body and nothing stops it.
    """

    v: Array
    sigma: Array
    rho: float | Array
    converged: bool
    reason: str
    history: History
    stopped: bool = False
    error: bool = False
    law: ContactLaw | None = None
    alpha: Array = field(default_factory=lambda: np.zeros(0))
    where: str = ""
    direct: bool = False
    unheld: bool = False

    @property
    def states(self) -> States:
        """0 stick, 1 slip, 2 open, (m,)."""
        assert self.law is not None
        return self.law.states(self.rho * self.v - self.sigma)

    def states_from(self, states: States, sigma: Array, slip: Array, share: float) -> States:
        """Return the states (m,) after a solution with others, whose tractions (m, k) and slip
        (m, d-1) are known to a share of the largest. What carries the same and has not slipped
        keeps its state: at the bound of friction round-off alone would tell slip from stick."""
        slid = lengths(self.v[:, : slip.shape[1]])
        same = lengths(self.sigma - sigma) <= share * np.abs(sigma).max(initial=0.0)
        same &= sigma.any(axis=1) & (slid <= share * np.abs(slip).max(initial=0.0))
        return np.where(same, states, self.states)

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of nodes that stick, slip and are open, without zeros."""
        if self.law is None:
            return {}
        numbers = np.bincount(self.states, minlength=3)
        return {
            name: int(n) for name, n in zip(("stick", "slip", "open"), numbers, strict=True) if n
        }


Start = tuple[Array, Array]
"""Initial v [length] and σ [stress], (m, k)."""
Monitor = Callable[[ContactState], str | None]
"""Function of the state after each iteration; if it returns a reason, the method ends."""
