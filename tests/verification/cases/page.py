"""The pages of the verification manual, Markdown, from a case and what was computed of it."""

from __future__ import annotations

from .case import FOLDER, Case

ROOT = FOLDER.parents[2]
PAGES = ROOT / "petcontact" / "manual" / "cases"
PICTURES = ROOT / "configs" / "pictures" / "verification"
SHOWN = "../../../configs/pictures/verification"
"""The same from a page."""
TABLE = ROOT / "petcontact" / "manual" / "cases.md"
WITHOUT = """The source has values at points, and no closed form of p and q. So the picture has no curve of it.
"""
KINDS = {
    "closed form": "closed form",
    "external source": "external source (other codes, papers)",
    "another code": "another code's own value",
}
HEAD = """# Verification manual

Published cases and closed forms, a page each.

Each one is solved by petcontact and has a page of its own: problem, reference with its uncertainty
and source, mesh, tested values, pictures. `scripts/verification` solves them again and writes these pages; a quick subset
is part of the tests (`tests/verification/cases/test_cases.py`). Values outside of their tolerance are listed like all others.
Numbers are those of a longer list of benchmarks; those that are missing were not chosen.

A ratio is computed / target. A tolerance is relative; that of an error, whose target is 0, is absolute. It depends on the reference. Where published
codes differ by 3 to 15 % it is as large. Where a closed form holds for half planes and the bodies are finite it is 1 %. Where the block is cut out of the
exact field it is 1e-3 or less.

| case | quantity | target | computed | ratio | tolerance | met |
| --- | --- | --- | --- | --- | --- | --- |
"""


def number(value: float) -> str:
    """Six digits."""
    return f"{value:.6g}"


def rows(case: Case, computed: list[float]) -> list[list[str]]:
    """Name, target, computed, ratio, tolerance, met, of each value."""
    return [
        [
            value.name,
            f"{number(value.reference)} {value.unit}".strip(),
            number(found) if value.reference else f"{found:.1e}",
            f"{found / value.reference:.4f}" if value.reference else "",
            f"{value.tolerance:g}",
            "yes" if value.met(found) else f"**no**: {value.missed}",
        ]
        for value, found in zip(case.values, computed, strict=True)
    ]


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|q|", "\\|q\\|") for cell in cells) + " |"


def table(cases: list[Case], computed: dict[str, list[float]]) -> str:
    """The chapter with the values of all cases; what was not computed stands as it is."""
    before, lines = TABLE.read_text().splitlines() if TABLE.exists() else [], []
    for case in cases:
        link = f"[{case.number}](cases/{case.name}.md)"
        if case.name not in computed:
            lines += [line for line in before if line.startswith(f"| {link} |")]
        else:
            lines += [_line([link, *cells]) for cells in rows(case, computed[case.name])]
    titles = "\n".join(f"- [{case.number}: {case.title}](cases/{case.name}.md)" for case in cases)
    return HEAD + "\n".join(lines) + "\n\n## The pages\n\n" + titles + "\n"


def page(case: Case, computed: list[float], mesh: str) -> str:
    """The page of a case; `mesh` is the line that says what was solved."""
    parts = [f"# {case.number}: {case.title}\n", f"## Problem\n\n{case.text}\n"]
    parts.append(
        f"![Problem: what is held, loaded and in contact]({SHOWN}/{case.name}-problem.png)\n"
    )
    module, _, name = case.problem.partition(":")
    where = (
        str(case.config.relative_to(ROOT))
        if case.config
        else f"{name}` of `tests/verification/cases/{module}.py"
    )
    parts.append(f"Posed by `{where}`.\n")
    kind = KINDS[case.kind]
    parts.append(
        f"## Reference\n\n- Type: {kind}.\n- Uncertainty: {case.uncertainty}.\n- Source: "
        f"{case.source}.\n"
    )
    parts.append(f"## Mesh\n\n{case.mesh}\n\n{mesh}\n" if case.mesh else f"## Mesh\n\n{mesh}\n")
    lines = [_line(cells) for cells in rows(case, computed)]
    parts.append(
        "\n".join(
            [
                "## Tested values\n",
                "| quantity | target | computed | ratio | tolerance | met |",
                "| --- | --- | --- | --- | --- | --- |",
                *lines,
                "",
            ]
        )
    )
    others = sorted({f"{value.name}: {value.source}" for value in case.values if value.source})
    if others:
        parts.append("Targets of another source: " + "; ".join(others) + ".\n")
    parts.append(f"## Picture\n\n![Contact tractions]({SHOWN}/{case.name}-contact.png)\n")
    if not (case.curve or any(value.measure == "error" for value in case.values)):
        parts.append(WITHOUT)
    return "\n".join(parts)


def solved_line(solution) -> str:
    """How many elements, unknowns and iterations."""
    orders = sorted({int(order) for mesh in solution.meshes.values() for order in mesh.order})
    elements = sum(mesh.n_elements for mesh in solution.meshes.values())
    unknowns = sum(mesh.components * mesh.n_nodes for mesh in solution.meshes.values())
    order = "-".join(map(str, dict.fromkeys((orders[0], orders[-1]))))
    accuracy = solution.accuracy
    reported = f" Estimated error of p and q: {accuracy.error:.1e}." if accuracy.is_known else ""
    return (
        f"{elements} elements of order {order}, {unknowns} unknowns, {len(solution.steps)} "
        f"increment{'s' if len(solution.steps) > 1 else ''}, {solution.iterations} "
        f"iterations.{reported}"
    )
