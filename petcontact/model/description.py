"""A problem in a few lines, as `print` and notebooks show it."""

from __future__ import annotations

from ..given.conditions import Condition
from ..given.interface_data import Law
from ..given.values import Given
from .bodies import Body, Contact, Pair, names_of
from .load_steps import ObstacleChange, PointForceChange
from .setting import Bodies


def summary(problem: Bodies) -> list[tuple[str, str]]:
    """What a `Problem` consists of: a name and a line for each body, obstacle, contact and step,
    and for the method."""
    rows = [
        ("body" if problem.is_flat else f"body {body.name}", _body(body)) for body in problem.body
    ]
    for obstacle in problem.obstacle:
        given = [
            f"{key} {value_text(getattr(obstacle, key))}"
            for key in ("displacement", "rotation", "force", "moment")
            if key in obstacle.model_fields_set
        ]
        rows.append((f"obstacle {obstacle.name}", ", ".join(given) or "fixed"))
    rows += [
        (f"contact {pair.name}", f"{on}, {law_text(pair)}")
        for pair in problem.contact
        for on in [" on ".join(map(", ".join, map(names_of, (pair.secondary, pair.primary))))]
    ]
    for k, step in enumerate(problem.step, 1):
        named: list[ObstacleChange | PointForceChange] = [*step.obstacle, *step.point_force]
        changed = [*(c.part for c in step.boundary), *(c.name for c in named)]
        changed += ["loads"] * bool(step.loads)
        count = f"{step.increments} increment{'s' * (step.increments != 1)}"
        rows.append(
            (f"step {step.name or k}", f"{count}; changes {', '.join(changed) or 'nothing'}")
        )
    return [*rows, ("method", problem.method.resolved_name)]


def html_table(caption: str, rows: list[tuple[str, str]]) -> str:
    """The rows as a table for notebooks."""
    cell = "<t{0} style='text-align:left'>{1}</t{0}>"
    import html

    lines = (
        "".join(cell.format(*pair) for pair in zip("hd", map(html.escape, row), strict=True))
        for row in rows
    )
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><caption>{html.escape(caption)}</caption>{body}</table>"


def _body(body: Body) -> str:
    """Shape, material and the conditions of the parts."""
    parts = {
        kind: [c.part for c in body.boundary if c.condition == kind]
        for kind in ("displacement", "traction", "symmetry", "periodic")
    }
    given = [f"{kind} on {', '.join(names)}" for kind, names in parts.items() if names]
    given += [
        f"contact on {c.part}, {law_text(c)}" for c in body.boundary if isinstance(c, Contact)
    ]
    given += [f"{len(body.point_force)} point forces"] * bool(body.point_force)
    loads = body.loads.model_fields_set if body.loads else set()
    given += [key.replace("_", " ") for key in sorted(loads - {"centre", "axis"})]
    material = f"E = {body.material.young_modulus:g}, ν = {body.material.poisson_ratio:g}"
    return "; ".join([f"{body.geometry.shape}, {material}", *given])


SHORT = 40
"""Characters of an expression that a summary and a picture have room for."""


def condition_text(condition: Condition) -> str:
    """What a condition of a part says, in a few characters.

    Examples
    --------
    >>> from petcontact.given.conditions import Displacement, Traction
    >>> from petcontact.given.values import as_given
    >>> condition_text(Displacement("top", (None, as_given(-0.01, "value[1]"))))
    'u = [free, -0.01]'
    >>> condition_text(Traction("left", pressure=as_given("20*x", "pressure")))
    'p = 20*x'
    >>> text = "20*exp(-x**2)*(x > 0.5)*(x < 2.5)*(y > 1)"
    >>> condition_text(Traction("left", pressure=as_given(text, "pressure")))
    'p = by an expression'
    """
    if not condition.terms:
        return type(condition).__name__.lower()
    letters = {"displacement": "Δu" if getattr(condition, "onward", False) else "u"}
    return ", ".join(
        f"p = {value_text(term.data[0])}"
        if term.is_pressure
        else f"{letters.get(term.kind, 't')} = {value_text(term.data)}"
        for term in condition.terms
    )


def law_text(law: Contact | Pair | Law) -> str:
    """What holds where two sides meet: the normal condition and the friction.

    Examples
    --------
    >>> from petcontact.model.bodies import Contact
    >>> law_text(Contact("bottom", normal="unilateral"))
    'unilateral, frictionless'
    """
    names = {"friction_coefficient": "friction coefficient", "friction_bound": "friction bound"}
    given = [
        f"{name} {value_text(getattr(law, key))}"
        for key, name in names.items()
        if getattr(law, key) is not None
    ]
    return ", ".join([law.normal, *(given or ["frictionless"] * (law.normal != "bonded"))])


def value_text(value: object) -> str:
    """A number, an expression or a few of them; a function, a long expression or an array of many
    values by its kind."""
    if isinstance(value, Given | None):
        return "free" if value is None else value_text(value.source)
    if callable(value):
        name = getattr(value, "__name__", "<lambda>")
        return "by a function" if name == "<lambda>" else f"by {name}"
    if isinstance(value, tuple):
        texts = [*map(value_text, value)]
        if len(texts) > 3:
            return f"by {len(texts)} values"
        return (
            texts[0]
            if len({*texts}) == 1 and texts[0].startswith("by a")
            else f"[{', '.join(texts)}]"
        )
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= SHORT else "by an expression"
