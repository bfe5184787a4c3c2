"""Nowell and Hills (1987): a cylinder pressed on a specimen under tension and pushed along it;
stick is off the middle.

D. A. Hills, D. Nowell, Mechanics of Fretting Fatigue, 1994. Equal bodies in plane strain, half
planes.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..record import record
from .cattaneo_mindlin import LinePartialSlip
from .hertz import elliptic


@record
class FrettingContact(LinePartialSlip):
    """A specimen pulled by σ along x, and pushed towards -x by the shear Q of the contact: x = a is
    the trailing edge.

    Parameters
    ----------
    contact, friction, force
        P, µ and Q < µP, see `LinePartialSlip`.
    bulk : float
        σ >= 0 far away [stress].

    Raises
    ------
    ValueError
        If the stick zone would reach beyond the contact, c + e > a: slip is of both signs then.

    Examples
    --------
    A pad of R = 10 on aluminium, after Kosec and others (2019):

    >>> from petcontact.reference.hertz import LineContact, contact_modulus
    >>> pad = LineContact(135.75, 10.0, contact_modulus(72100.0, 0.33, 72100.0, 0.33))
    >>> fretting = FrettingContact(pad, friction=0.3, force=38.75, bulk=100.0)
    >>> round(fretting.stick_half_width, 6), round(fretting.stick_offset, 6)
    (0.045519, 0.041197)
    >>> round(float(fretting.stress(np.array([pad.half_width]))[0]), 2)
    345.75
    """

    bulk: float

    def __post_init__(self) -> None:
        if self.stick_half_width + abs(self.stick_offset) > self.contact.half_width:
            raise ValueError(
                "the stick zone reaches beyond the contact: the bulk stress is too large for this "
                "solution"
            )

    @property
    def stick_offset(self) -> float:
        """e = σa/(4µp_0): stick is |x + e| < c [length]."""
        return self.bulk * self.contact.half_width / (4.0 * self.friction * self.contact.peak)

    def traction(self, x: Array) -> Array:
        """Shear on the specimen towards -x at places (n,): µp_0 (√(1 - x²/a²) - c/a √(1 -
        (x+e)²/c²)) [stress]."""
        a, c = self.contact.half_width, self.stick_half_width
        return (
            self.friction
            * self.contact.peak
            * (elliptic(x, a) - c / a * elliptic(x + self.stick_offset, c))
        )

    def stress(self, x: Array) -> Array:
        """σ_xx on the surface of the specimen at places (n,) [stress]."""
        a, c = self.contact.half_width, self.stick_half_width
        pulled = _outwards(x / a) - c / a * _outwards((x + self.stick_offset) / c)
        return (
            self.bulk - self.contact.pressure(x) + 2.0 * self.friction * self.contact.peak * pulled
        )


def _outwards(s: Array) -> Array:
    """s inside -1..1, s - sgn(s) √(s² - 1) outside: what an elliptic shear does to σ_xx."""
    return np.asarray(s - np.sign(s) * np.sqrt(np.maximum(s * s - 1.0, 0.0)))
