"""Each equation of the paper's method stands by its number at the line that computes it."""

from __future__ import annotations

from pathlib import Path

import pytest

import petcontact

PACKAGE = Path(petcontact.__file__).parent
LINES = [
    ("2.9", "contact/law_protocol.py", "sigma + law.project(rho * v - sigma)"),
    ("2.10", "contact/law_protocol.py", "sigma + law.project(rho * v - sigma)"),
    ("2.11", "contact/methods/projection.py", "law_residual(recorder.law, v, sigma, rho)"),
    ("3.1", "contact/methods/projection.py", "system.robin(rho, sigma + rho * v - self.omega"),
    ("3.1", "contact/methods/projection.py", "system.robin_increment(rho, -self.omega * residual)"),
    ("4.1", "contact/rho_rules.py", "sigma_change / u_change"),
    ("4.2", "contact/rho_rules.py", "(1.0 + self.growth) * rho"),
    ("4.2", "contact/rho_rules.py", "rho / (1.0 + self.growth)"),
    ("4.3", "contact/rho_rules.py", "return balance"),
    ("4.10", "bem/operators.py", "def residual"),
    ("4.11", "contact/methods/projection.py", "system.robin(rho, sigma + rho * v - self.omega"),
    ("4.11", "compliance/contact_compliance.py", "np.multiply(self._matrix[inner], factors"),
    ("4.12", "compliance/body/dense.py", "fill_dense(operators, nodes, inside, contact, loads)"),
    ("4.12", "compliance/body/full.py", "self._matrix.getDenseArray().T[self._places] ="),
    ("4.13", "compliance/body/dense.py", "fill_dense(operators, nodes, inside, contact, loads)"),
]


@pytest.mark.parametrize(("number", "file", "line"), LINES)
def test_the_number_stands_where_it_is_computed(number, file, line):
    """On the line itself, or on one of the two around it."""
    lines = (PACKAGE / file).read_text().splitlines()
    (place,) = (k for k, text in enumerate(lines) if line in text)
    assert any(f"({number})" in text for text in lines[max(place - 2, 0) : place + 2])
