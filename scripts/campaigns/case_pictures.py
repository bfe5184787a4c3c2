"""The two pictures of a case: what is posed, and what was found along its contact beside the
reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image
from verification.cases.measures import exact_values

from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.results.figures import plane_figures, space
from petcontact.results.figures.finite import end_at_corners
from petcontact.results.figures.model import draw_model
from petcontact.runtime.figure_style import label, legend_beside, save

COLOURS = 255
"""Of a PNG: a third of the size, and no difference that is seen."""
CURVES = {"pressure": "p", "shear": "q"}
LINES = ("displacement", "largest_von_mises")
"""Measures whose references are drawn on a line."""


def problem_picture(solution, path: Path) -> Path:
    """The problem as `petcontact draw` shows it."""
    return _small(path, draw_model, solution)


def contact_picture(case, solution, path: Path) -> Path:
    """Pressure and shear along the last interface at the end with the reference, in space over
    the distance from its middle; or what the reference has on a line."""
    mesh = next(iter(solution.meshes.values()))
    if case.line:
        return _small(path, draw_line, solution, case)
    if isinstance(mesh, CurveMesh):
        return _small(path, draw_curves, solution, case)
    if case.curve:
        return _small(path, draw_radial, solution, case.curve)
    return _small(path, space.draw_normal, solution)


def _small(path, draw, *arguments):
    """A PNG of few colours."""
    save(path, draw, *arguments)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    small.save(path, optimize=True)
    return path


def draw_line(figure, solution, case):
    """Components of the displacement, or the von Mises stress, on a line inside a body, with closed
    forms and tested points."""
    line, axes, units = case.line, figure.add_subplot(), solution.problem.units
    points = np.linspace(line["start"], line["end"], 201)
    k, state = int(np.ptp(points, axis=0).argmax()), solution.state_at(points, line.get("body"))
    for exact, component in zip(line["exact"], line.get("components", [None]), strict=True):
        found = state.von_mises if component is None else state.u[:, component]
        name = "von Mises" if component is None else f"$u_{'xyz'[component]}$"
        axes.plot(points[:, k], found, label=f"{name} computed")
        if exact:
            form, drawn = exact_values(points, exact), {"ls": "--", "color": "black", "lw": 0.9}
            axes.plot(points[:, k], form, **drawn, label=f"{name} closed form")
        for value in case.values:
            at = value.keys.get("at", points[np.argmax(found)])
            if value.measure in LINES and value.keys.get("component") == component:
                named = axes.get_legend_handles_labels()[1]
                new = None if "reference" in named else "reference"
                axes.plot(at[k], value.reference, "kx", ms=7.0, label=new)
    of_stress = "components" not in line
    axes.set(
        xlabel=label("xyz"[k], units.length),
        ylabel=label("stress", units.stress) if of_stress else label("displacement", units.length),
    )
    legend_beside(axes)


def arc_length_at(pair, x):
    """Arc length of a point on the line through the two nodes of a pair that are nearest to it."""
    i, j = np.argsort(np.linalg.norm(pair.x - x, axis=1))[:2]
    way = pair.x[j] - pair.x[i]
    share = (x - pair.x[i]) @ way / (way @ way)
    return pair.arc_length[i] + share * (pair.arc_length[j] - pair.arc_length[i])


def draw_curves(figure, solution, case):
    """Pressure and shear, the exact curves of values that are errors, and tested points."""
    values, curve = case.values, case.curve
    name = list(solution.pairs)[-1]
    pair, axes = solution.pairs[name], figure.add_subplot()
    order = np.argsort(pair.arc_length)
    s, units = pair.arc_length[order], solution.problem.units
    plane_figures._shaded(axes, solution, name)
    plane_figures._window(axes, [pair])
    shear = np.linalg.norm(pair.sigma_t, axis=1)
    found = {"pressure": pair.pressure}
    if shear.max(initial=0.0) > 1e-9 * np.abs(pair.pressure).max(initial=1.0):
        found["shear"] = shear
    for key, letter in CURVES.items():
        if key in found:
            axes.plot(s, found[key][order], label=f"{'|q|' if key == 'shear' else letter} computed")
    references = [value for value in values if value.keys.get("pair") == name and not value.set]
    exact = {v.keys["of"]: v.keys["exact"] for v in references if v.measure == "error"} | curve
    for key, function in exact.items():
        axes.plot(
            s,
            exact_values(pair.x, function)[order],
            ls="--",
            color="black",
            lw=0.9,
            label=f"{CURVES[key]} closed form",
        )
    if case.multiple:
        step, factor = case.multiple
        former = solution.steps[step - 1].pairs[name].pressure
        axes.plot(
            s,
            factor * former[order],
            ls="--",
            color="black",
            lw=0.9,
            label=f"{factor:g} times p of step {step}",
        )
    for at in case.edges:
        named = (
            None if "edge, reference" in axes.get_legend_handles_labels()[1] else "edge, reference"
        )
        axes.axvline(
            arc_length_at(pair, np.asarray(at)), ls=":", color="black", lw=1.0, label=named
        )
    for value in references:
        if value.measure == "largest_pressure":
            along = pair.arc_length[np.argmax(pair.pressure)]
        elif value.measure in CURVES and "step" not in value.keys:
            along = arc_length_at(pair, np.asarray(value.keys["at"]))
        else:
            continue
        named = None if "reference" in axes.get_legend_handles_labels()[1] else "reference"
        height = value.keys.get("sign", 1.0) * value.reference
        axes.plot(along, height, "kx", ms=7.0, label=named)
    if np.ptp(pair.pressure) < 0.01 * pair.pressure.max():  # a constant, but for round-off
        axes.set_ylim(0.0, 1.2 * pair.pressure.max())
    end_at_corners(axes, solution, name, list(found.values()))
    axes.set(
        xlabel=label(f"arc length along {'.'.join(solution.sides[name])}", units.length),
        ylabel=label("traction", units.stress),
    )
    legend_beside(axes)


def draw_radial(figure, solution, curve):
    """Pressure and shear at the nodes of a round contact over the distance from its middle, with
    the closed forms; an axis ends where few values of a rim are beyond."""
    name = list(solution.pairs)[-1]
    pair, axes, units = solution.pairs[name], figure.add_subplot(), solution.problem.units
    r = np.linalg.norm(pair.x[:, :2], axis=1)
    along = np.linspace(0.0, 1.5 * r[pair.pressure > 0.0].max(), 500)[:-1]
    places = np.column_stack([along, 0.0 * along, 0.0 * along])
    found = {"pressure": pair.pressure, "shear": np.linalg.norm(pair.sigma_t, axis=1)}
    for key, function in curve.items():
        axes.plot(r, found[key], ".", ms=4.0, label=f"{CURVES[key]} computed, at nodes")
        with np.errstate(invalid="ignore"):
            exact = exact_values(places, function)
        axes.plot(along, exact, ls="--", color="black", lw=0.9, label=f"{CURVES[key]} closed form")
    most = 4.0 * float(np.median(pair.pressure[pair.pressure > 0.0]))
    axes.set(xlim=(0.0, along[-1]), ylim=(0.0, min(most, 1.1 * pair.pressure.max())))
    axes.set(
        xlabel=label("distance from the middle", units.length),
        ylabel=label("traction", units.stress),
    )
    legend_beside(axes)
