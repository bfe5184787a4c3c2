"""Blocks between smooth rigid sides, whose fields are sums of cosines: an oracle of frictionless
contact in space that shares nothing with the package."""

from __future__ import annotations

import numpy as np
import scipy.fft


def layer(k, height, modulus=1.0, ratio=0.3):
    """Values (n, 4, 4) of four solutions of a layer, z from 0 to its height, that vary as cos(kx):
    u_x and u_z, σ_xz and σ_zz at the top and at the bottom, by Airy's function of plane strain.

    Its solutions are e^-s, s e^-s with s = kz, and the same from the top; derivatives are over k.
    """
    result = np.empty((len(k), 2, 4, 4))
    soft = (1.0 + ratio) / (modulus * k)[:, None]
    for end, z in enumerate((height, 0.0)):
        s, t = k * z, k * (height - z)

        def airy(n, s=s, t=t):
            sign = (-1.0) ** n
            down, up = np.exp(-s), np.exp(-t)
            return np.stack([sign * down, sign * (s - n) * down, up, (t - n) * up], axis=1)

        result[:, end, 0] = soft * ((1.0 - ratio) * airy(2) + ratio * airy(0))
        result[:, end, 1] = soft * ((1.0 - ratio) * airy(3) - (2.0 - ratio) * airy(1))
        result[:, end, 2], result[:, end, 3] = airy(1), -airy(0)
    return result


def answers(k, height, top, bottom, asked, modulus=1.0, ratio=0.3):
    """How far a face moves along z under what is given on both, (n, 2): under the second given value
    of the top and of the bottom, "traction" or "displacement" each, the first being 0.

    `asked`: 0, the top, or 1, the bottom. k > 0.
    """
    every = layer(k, height, modulus, ratio)
    rows = {"displacement": (0, 1), "traction": (2, 3)}
    given = np.concatenate([every[:, 0, rows[top]], every[:, 1, rows[bottom]]], axis=1)
    unit = np.zeros((4, 2))
    unit[1, 0] = unit[3, 1] = 1.0
    constants = np.linalg.solve(given, np.broadcast_to(unit, (len(k), 4, 2)))
    return np.einsum("kc,kcg->kg", every[:, asked, 1], constants)


class Block:
    """A block on a square of a side, between smooth rigid sides, in frictionless contact on one
    face.

    Parameters
    ----------
    side, height : float
    count : int
        Cells of the face along each side.
    held : bool
        Whether the other face is held in all directions, else it carries normal tractions.
    """

    def __init__(self, side, height, count, held, modulus=1.0, ratio=0.3):
        self.size, self.count, self.held = side / count, count, held
        line = self.size * (np.arange(count) + 0.5)
        self.x, self.y = np.meshgrid(line, line, indexing="ij")
        wave = np.pi / side * np.arange(count)
        k = np.hypot(wave[:, None], wave).ravel()
        other = "displacement" if held else "traction"
        found = answers(k[1:], height, "traction", other, 0, modulus, ratio)
        oedometric = modulus * (1.0 - ratio) / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
        self.own, self.far = np.zeros((2, count, count))
        self.own.flat[1:], self.far.flat[1:] = found[:, 0], found[:, 1]
        self.own[0, 0], self.far[0, 0] = (height / oedometric, 1.0) if held else (0.0, 0.0)

    def from_back(self, values):
        """How far the face moves outwards under what is given at the back: its displacement
        towards the face where it is held, else the pressure on it."""
        return self.by(self.far if self.held else -self.far, values)

    @staticmethod
    def by(symbol, values):
        """Sum of cosines of values at cells, each times its symbol."""
        return scipy.fft.idctn(symbol * scipy.fft.dctn(values, norm="ortho"), norm="ortho")

    def pressure(self, gap, force=None, tolerance=1e-7, most=3000):
        """p at the cells under a gap that closes; of a given resultant, or none: the bodies do not
        move together.

        Conjugate gradients on the closed cells (Polonsky and Keer, Wear 231, 1999).
        """
        area, free = self.size**2, force is not None
        p = np.full(gap.shape, force / (area * gap.size) if free else 0.0)
        if not free:
            p[gap < 0.0] = -gap[gap < 0.0] / self.own.max()
        along, before, restart = np.zeros_like(p), 1.0, True
        for _ in range(most):
            opening = gap + self.by(self.own, p)
            closed = p > 0.0
            if free:
                opening -= opening[closed].mean()
            left = np.where(closed, opening, 0.0)
            square = float((left**2).sum())
            along = np.where(closed, left + (0.0 if restart else square / before) * along, 0.0)
            moved = self.by(self.own, along)
            if free:
                moved -= moved[closed].mean()
            work = float((along * moved)[closed].sum())
            step = float((left * along).sum()) / work if work > 0.0 else 0.0
            old, p = p, np.maximum(p - step * along, 0.0)
            overlapping = (p == 0.0) & (opening < 0.0)
            restart = bool(overlapping.any())
            scale = max(step, 1.0 / float(self.own.max()))
            p[overlapping] -= scale * opening[overlapping]
            if free:
                p *= force / (area * p.sum())
            before = square or 1.0
            if np.abs(p - old).sum() <= tolerance * p.sum():
                break
        return p
