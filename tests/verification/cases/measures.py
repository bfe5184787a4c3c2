"""What the verification manual reads off a solution: each function is a `measure` of the data file
of a case.

The first argument is the solution; the others are keys of the value's table. A place is a point
`at`; an increment is a number `step`, from 1, the last one by default.
"""

from __future__ import annotations

import importlib

import numpy as np

from petcontact.given.sites import Sites
from petcontact.given.values import as_given
from petcontact.refinement.contact_edges import edges


def _increment(solution, step):
    """By its number from 1 on, or back from the last one, which is 0: a step may be divided."""
    return solution.last if step is None else solution.steps[step - 1]


def _at(x, element, values, at):
    """Value at a point of the boundary: the polynomial of the nearest element through its nodes."""
    at = np.asarray(at, dtype=float)
    middle = np.array([x[element == e].mean(axis=0) for e in np.unique(element)])
    near = element == np.unique(element)[np.argmin(np.linalg.norm(middle - at, axis=1))]
    nodes = x[near] - at
    count = int(near.sum())
    # coordinates in the element: its principal directions
    directions = np.linalg.svd(nodes - nodes.mean(axis=0))[2][: x.shape[1] - 1]
    local = nodes @ directions.T / np.abs(nodes).max()
    powers = [p for p in np.ndindex(*(count,) * local.shape[1]) if sum(p) < count]
    powers = sorted(
        powers, key=lambda p: (max(p) if round(count**0.5) ** 2 == count else sum(p), sum(p))
    )[:count]
    terms = np.stack([np.prod(local ** np.array(p), axis=1) for p in powers], axis=1)
    return float(np.linalg.lstsq(terms, values[near], rcond=None)[0][0])


def _of_pair(solution, name, step):
    body, _ = solution.sides[name]
    return _increment(solution, step).pairs[name], solution.meshes[body].element[
        solution.nodes[name]
    ]


def displacement(solution, *, at, component, part, body=None, step=None):
    """u of a point of a part [length]."""
    name = body or next(iter(solution.meshes))
    mesh = solution.meshes[name]
    nodes = mesh.nodes_of(part)
    u = _increment(solution, step).bodies[name].u
    return _at(mesh.x[nodes], mesh.element[nodes], u[nodes, component], at)


def difference(solution, *, of, first, second, **keywords):
    """A measure at `first` minus that at `second`, both tables of its keys."""
    function = globals()[of]
    return function(solution, **keywords, **first) - function(solution, **keywords, **second)


def stress(solution, *, at, component, body=None, step=None):
    """σ_xx, σ_yy, σ_xy (in space xx, yy, zz, xy, xz, yz) at a point inside [stress]."""
    return float(solution.stress_at([at], body, step)[0, component])


def largest_von_mises(solution, *, start, end, points=200, body=None):
    """Largest von Mises stress on a line inside [stress]."""
    return float(solution.von_mises_at(np.linspace(start, end, points), body).max())


def pressure(solution, *, pair, at, step=None, sign=1.0):
    """p at a point of the secondary, times a sign [stress]."""
    found, element = _of_pair(solution, pair, step)
    return sign * _at(found.x, element, found.pressure, at)


def largest_pressure(solution, *, pair, step=None):
    """Largest p at the nodes [stress]."""
    return float(_increment(solution, step).pairs[pair].pressure.max())


def shear(solution, *, pair, at, step=None):
    """|q| at a point of the secondary [stress]."""
    found, element = _of_pair(solution, pair, step)
    return _at(found.x, element, np.linalg.norm(found.sigma_t, axis=1), at)


def largest_shear(solution, *, pair, step=None):
    """Largest |q| at the nodes [stress]."""
    return float(np.linalg.norm(_increment(solution, step).pairs[pair].sigma_t, axis=1).max())


def _edges(solution, pair, state, step):
    """First and last end, along the secondary, of what is closed or sticks, as points (2, d)."""
    found, _ = _of_pair(solution, pair, step)
    order = np.argsort(found.arc_length)
    s = found.arc_length[order]
    inside = found.state[order] != 2 if state == "closed" else found.state[order] == 0
    states = np.where(inside, 1, 2) if state == "closed" else np.where(inside, 0, 1)
    p, q, bound, gap, moved = (
        values[order]
        for values in (
            found.pressure,
            found.sigma_t[:, 0],
            found.bound,
            found.gap,
            found.slip_increment[:, 0],
        )
    )
    found_at = [edge.s for edge in edges(s, p, q, bound, gap, moved, states)]
    (first, last), outside = np.flatnonzero(inside)[[0, -1]], [-np.inf, *s, np.inf]
    places = [
        min(
            [s[node], *found_at],
            key=lambda place, between=0.5 * (s[node] + beside): abs(place - between),
        )
        if np.isfinite(beside)
        else s[node]
        for node, beside in ((first, outside[first]), (last, outside[last + 2]))
    ]
    return np.array(
        [[np.interp(place, s, found.x[order, k]) for k in range(2)] for place in places]
    )


def half_width(solution, *, pair, state="closed", step=None):
    """Half the distance of the two ends of what is "closed", or of the "stick" zone, in the plane
    [length]."""
    return 0.5 * float(np.linalg.norm(np.diff(_edges(solution, pair, state, step), axis=0)))


def stick_share(solution, *, pair, step=None):
    """c/a, of the half widths of stick and contact, in the plane [-]."""
    return half_width(solution, pair=pair, state="stick", step=step) / half_width(
        solution, pair=pair, step=step
    )


def offset(solution, *, pair, component=0, step=None):
    """Middle of the stick zone less that of the contact, in the plane [length]."""
    stick, closed = (_edges(solution, pair, state, step) for state in ("stick", "closed"))
    return float((stick - closed)[:, component].mean())


def radius(solution, *, pair, state="closed", step=None):
    """Radius of the circle that has the area of what is "closed", or of the "stick" zone, in space
    [length]."""
    found = _increment(solution, step).pairs[pair]
    inside = found.state != 2 if state == "closed" else found.state == 0
    return float(np.sqrt(found.weight[inside].sum() / np.pi))


def ratio(solution, *, of, first, second, **keywords):
    """A measure with the keys `first` over that with the keys `second` [-]."""
    function = globals()[of]
    return function(solution, **keywords, **first) / function(solution, **keywords, **second)


def share_of(solution, *, pair, state, step=None):
    """Share of the closed nodes in a state: 0 stick, 1 slip [-]."""
    found = _increment(solution, step).pairs[pair]
    return float(found.weight[found.state == state].sum() / found.weight[found.state != 2].sum())


def force(solution, *, pair, component, step=None):
    """Of the contact on the secondary [force/length, in space force]."""
    return float(_increment(solution, step).pairs[pair].force[component])


def reaction(solution, *, part, component, step=None):
    """Of the tractions on a part of the only body [force/length, in space force]."""
    return float(solution.reactions(_increment(solution, step))[part][component])


def moment(solution, *, pair, component=0, step=None):
    """Of the contact on the secondary, about the origin, in the plane or about an axis [force, in
    space force · length]."""
    return float(np.atleast_1d(_increment(solution, step).pairs[pair].moment)[component])


def motion(solution, *, obstacle, component, step=None):
    """Displacement of an obstacle [length]."""
    return float(_increment(solution, step).obstacles[obstacle].displacement[component])


def dissipated(solution, *, pair, steps):
    """Energy that friction took in load steps of these numbers [force, in space force · length]."""
    return float(sum(step.pairs[pair].dissipated for step in solution.steps if step.step in steps))


def error(solution, *, pair, of, exact, step=None):
    """Relative L2 error of "pressure" or "shear" (|q|) against an expression in x, y, z, or a
    function MODULE:NAME [-]."""
    found = _increment(solution, step).pairs[pair]
    values = found.pressure if of == "pressure" else np.linalg.norm(found.sigma_t, axis=1)
    wanted = exact_values(found.x, exact)
    return float(np.sqrt(found.weight @ (values - wanted) ** 2 / (found.weight @ wanted**2)))


def exact_values(x, exact):
    """An expression in x, y, z, or a function MODULE:NAME, at points (m, d)."""
    if ":" in exact:
        module, name = exact.split(":")
        return getattr(importlib.import_module(f"{__package__}.{module}"), name)(x)
    return as_given(exact, "exact").at(Sites(x))
