"""Problems A and B in space: reference values, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from petcontact import InputError, Problem, load, solve

pytestmark = pytest.mark.usefixtures("unestimated")

CONFIGS = Path(__file__).parents[3] / "configs"
# three finest meshes of a prototype (N = 3240 to 98 010 nodes); this mesh of 360 nodes is 0.3 to 2
# % off
REFERENCE = {
    "a": {"force": (-2920.40, 0.0), "normal": 1236.0, "size": 0.13409, "work": -60.250},
    "b": {"force": (-2851.45, -3007.07), "normal": 2161.6},
}


def posed(letter: str, **keys: object) -> Problem:
    return load(CONFIGS / f"space_{letter}.toml", {"mesh.element_size": 2.0, **keys})


@pytest.mark.parametrize("letter", ["a", "b"])
def test_reference_values(letter: str) -> None:
    solution = solve(posed(letter))
    assert solution.converged and solution.iterations <= 12
    contact, wanted = solution.contact, REFERENCE[letter]
    force = contact.weight @ np.einsum("nk,nkd->nd", contact.sigma_t, contact.tangent)
    np.testing.assert_allclose(force[:2], wanted["force"], atol=12.0)
    assert solution.reactions()["bottom"][2] == pytest.approx(wanted["normal"], rel=0.015)
    if "size" in wanted:
        assert np.sqrt(contact.weight @ np.sum(contact.u_t**2, axis=1)) == pytest.approx(
            wanted["size"], rel=0.015
        )
        assert contact.weight @ np.sum(contact.u_t * contact.sigma_t, axis=1) == pytest.approx(
            wanted["work"], rel=0.015
        )
    # the law: within the bound, and against the slip where there is any
    size, slip = np.linalg.norm(contact.sigma_t, axis=1), np.linalg.norm(contact.u_t, axis=1)
    assert size.max() <= 150.0 * (1.0 + 1e-5)
    slides = slip > 1e-4 * slip.max()
    np.testing.assert_allclose(
        contact.sigma_t[slides] / 150.0, -contact.u_t[slides] / slip[slides, None], atol=1e-4
    )


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"mesh.order": 4}, "mesh.order: panels in space have order 0 to 3"),
        ({"mesh.element_size": 1e-3}, "at most"),
        ({"mesh.element_sizes": {"side": 1.0}}, "no part 'side'"),
        ({"bem.mat_type": "hodlr"}, "plane bodies"),
        ({"geometry.upper": [0.0, 4.0, 4.0]}, "each coordinate of upper must be greater"),
    ],
    ids=lambda value: value if isinstance(value, str) else next(iter(value)),
)
def test_bad_input_is_one_line(keys: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        solve(posed("a", **keys))
    assert "\n" not in str(caught.value)
