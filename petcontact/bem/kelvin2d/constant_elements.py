"""Both kernels over straight elements of order 0, all pairs in closed form with as few passes over memory as possible.

With d_1, d_2 the vectors from the end points to the target, a half the length, τ the tangent, h = d·τ⊥ the distance from
the line on the left, ξ = (d_1 + d_2)·τ/2a, θ the angle from d_1 to d_2 and W = ln |d_1|²/|d_2|² (all from the
antiderivatives of ln r, 1/r² and r r/r⁴ along the element):

    ∫ ln r ds     = a/2 [ln |d_1|² + ln |d_2|² + ξW + 2hθ/a - 4]
    ∫ r r/r² ds   = a I + a D(τ² (1 - hθ/a + ihW/2a))
    ∫ r·n/r² ds   = θ,    ∫ r·τ/r² ds = -W/2
    ∫ (2 r r/r² - I) r·n/r² ds = 2a h D(d_1 d_2)/(|d_1|² |d_2|²)

where vectors are complex numbers and D(m) = [[Re m, Im m], [Im m, -Re m]].
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index

Pairs = tuple[Index, Index]


def constant(
    kernel_g: Array | None, kernel_h: Array | None, start: Array, end: Array, point: Array, off_line: Array | None,
    own: Pairs, own_xi: Array, poisson_ratio: float, length: float,
) -> None:  # fmt: skip
    """Fill G and H of straight elements of order 0, exact to round-off at every distance.

    Parameters
    ----------
    kernel_g, kernel_h : (2, 2, n, m) arrays or None
        Where 2µ ∫ U_ij ds [length] and ∫ T_ij ds [-] go.
    start, end : (n, 2) arrays
        End points; neighbours that share one are consecutive.
    point : (m, 2) array
        Targets.
    off_line : (1 or n, m) array or None
        0 where element and target lie on one straight line, else 1; None where all are 1.
    own : pair of index arrays
        Elements and targets that are nodes of the element, at local coordinates `own_xi`.
    poisson_ratio, length : float
        ν of plane strain; the unit of the logarithm's argument.
    """
    # Neighbours share an end point, and with it the distances and logarithms to all targets.
    chained = bool(np.all(end[:-1] == start[1:]))
    vertex = np.concatenate([start, end[-1:] if chained else end])
    one, two = (slice(0, -1), slice(1, None)) if chained else (slice(0, len(start)), slice(len(start), None))
    chord = end - start
    half = 0.5 * np.hypot(chord[:, :1], chord[:, 1:])
    tx, ty = 0.5 * chord[:, :1] / half, 0.5 * chord[:, 1:] / half
    half_square = half * half

    dx, dy = point[:, 0] - vertex[:, :1], point[:, 1] - vertex[:, 1:]
    distance = dx * dx
    distance += dy * dy
    if len(own[0]):
        column = own[1]
        for rows, reach in ((one, 1.0 + own_xi), (two, 1.0 - own_xi)):
            distance[rows][own[0], column] = (half[own[0], 0] * reach) ** 2
    x_1, x_2, y_1, y_2, square_1, square_2 = dx[one], dx[two], dy[one], dy[two], distance[one], distance[two]

    offset = x_1 + x_2
    offset *= 0.5 * tx / half
    work = y_1 + y_2
    work *= 0.5 * ty / half
    offset += work
    double_h = y_1 * (2.0 * tx / half)
    np.multiply(x_1, 2.0 * ty / half, out=work)
    double_h -= work
    nearest = np.minimum(square_1, square_2)
    if nearest.min() < 0.01 * half_square.max():
        # Close to an end point the distance from the line has to come from the differences to that end.
        e, k = np.nonzero((square_2 < square_1) & (square_2 < 0.01 * half_square))
        double_h[e, k] = 2.0 * (y_2[e, k] * tx[e, 0] - x_2[e, k] * ty[e, 0]) / half[e, 0]
    if off_line is not None:
        double_h *= off_line
    double_h[own] = 0.0
    offset[own] = own_xi

    # W, without cancellation for distant targets.
    ratio = np.abs(offset)
    ratio *= 4.0 * half_square
    ratio /= nearest
    np.log1p(ratio, out=ratio)
    np.copysign(ratio, offset, out=ratio)
    xx, yy = np.multiply(x_1, x_2, out=nearest), np.multiply(y_1, y_2, out=work)
    angle = xx + yy
    np.arctan2(double_h * half_square, angle, out=angle)
    if off_line is not None:
        angle *= off_line
    angle[own] = 0.0
    scale = 1.0 / (4.0 * np.pi * (1.0 - poisson_ratio))
    if kernel_h is not None:
        dipole = double_h * (-scale * half_square)
        dipole /= square_1 * square_2
        deviator = np.subtract(xx, yy, out=xx)
        deviator *= dipole
        isotropic = np.multiply(angle, -scale * (2.0 - 2.0 * poisson_ratio), out=yy)
        np.add(isotropic, deviator, out=kernel_h[0, 0])
        np.subtract(isotropic, deviator, out=kernel_h[1, 1])
        np.multiply(x_1, y_2, out=xx)
        np.multiply(x_2, y_1, out=yy)
        xx += yy
        xx *= dipole
        rotation = np.multiply(ratio, 0.5 * scale * (1.0 - 2.0 * poisson_ratio), out=yy)
        np.add(xx, rotation, out=kernel_h[0, 1])
        np.subtract(xx, rotation, out=kernel_h[1, 0])
    if kernel_g is not None:
        factor = 3.0 - 4.0 * poisson_ratio
        scale_a = scale * half
        turn_re, turn_im = scale_a * (tx * tx - ty * ty), scale_a * (2.0 * tx * ty)
        np.log(distance, out=distance)
        angle *= double_h
        double_h *= ratio
        ratio *= offset
        ratio += square_1
        ratio += square_2
        ratio += angle
        ratio *= -0.5 * factor * scale_a
        off = np.multiply(double_h, 0.25 * turn_re, out=kernel_g[0, 1])
        np.multiply(angle, -0.5 * turn_im, out=work)
        off += work
        off += turn_im
        kernel_g[1, 0] = off
        angle *= -0.5 * turn_re
        double_h *= -0.25 * turn_im
        angle += double_h
        constants = scale_a * (1.0 + 2.0 * factor * (1.0 + np.log(length)))
        ratio += constants
        angle += turn_re
        np.add(ratio, angle, out=kernel_g[0, 0])
        np.subtract(ratio, angle, out=kernel_g[1, 1])
