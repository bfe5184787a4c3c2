"""The pages of the verification manual, Markdown, from a case and what was computed of it."""

from __future__ import annotations

from verification.cases.case import ROOT, TABLE, Case, rows

SHOWN = "../../../configs/pictures/verification"
"""The pictures from a page."""
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


def _table(titles: list[str], lines: list[list[str]]) -> str:
    return "\n".join([_line(titles), _line(["---"] * len(titles)), *map(_line, lines)]) + "\n"


def page(case: Case, computed: list[float], solved: dict[str, str]) -> str:
    """The page of a case; `solved` is what `solved_row` says of its solution."""
    module, _, name = case.problem.partition(":")
    where = (
        str(case.config.relative_to(ROOT))
        if case.config
        else f"{name}` of `tests/verification/cases/{module}.py"
    )
    titles = ["quantity", "target", "computed", "ratio", "tolerance", "met"]
    parts = [
        f"# {case.number}: {case.title}\n",
        f"## Problem\n\n{case.text}\n",
        _table(["data", ""], [[*pair] for pair in case.data.items()]),
        f"![Problem: what is held, loaded and in contact]({SHOWN}/{case.name}-problem.png)\n",
        f"Posed by `{where}`.\n",
        f"## Reference\n\n{case.uncertainty}.\n",
        _table(["type", "source"], [[KINDS[case.kind], case.source]]),
        f"## Mesh\n\n{case.mesh}\n" if case.mesh else "## Mesh\n",
        _table([*solved], [[*solved.values()]]),
        "## Tested values\n",
        _table(titles, rows(case, computed)),
    ]
    others = sorted({f"{value.name}: {value.source}" for value in case.values if value.source})
    if others:
        parts.append("Targets of another source: " + "; ".join(others) + ".\n")
    parts.append(f"## Picture\n\n![Contact tractions]({SHOWN}/{case.name}-contact.png)\n")
    if not (
        case.curve
        or any(case.line.get("exact", ()))
        or any(value.measure == "error" for value in case.values)
    ):
        parts.append(WITHOUT)
    return "\n".join(parts)


def solved_row(solution) -> dict[str, str]:
    """How many elements, unknowns and iterations, by their titles."""
    orders = sorted({int(order) for mesh in solution.meshes.values() for order in mesh.order})
    accuracy = solution.accuracy
    return {
        "elements": str(sum(mesh.n_elements for mesh in solution.meshes.values())),
        "order": "-".join(map(str, dict.fromkeys((orders[0], orders[-1])))),
        "unknowns": str(sum(m.components * m.n_nodes for m in solution.meshes.values())),
        "increments": str(len(solution.steps)),
        "iterations": str(solution.iterations),
        "estimated error of p and q": f"{accuracy.error:.1e}" if accuracy.is_known else "not known",
    }
