"""Expressions in x, y, nx, ny, s: what they give, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from petcontact import Contact, InputError, Rectangle
from petcontact.given.lines import lines_of
from petcontact.given.sites import Sites
from petcontact.given.values import as_given

X = np.array([0.0, 1.0, 2.0])
SITES = Sites(np.stack([X, X + 1.0], 1), np.tile([0.0, -1.0], (3, 1)), X / 2.0)


def value(text):
    """As of a problem, which parses expressions before they are evaluated."""
    return as_given(Contact("bottom", normal="bilateral", gap=text).gap, "gap").at(SITES)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (3, [3.0, 3.0, 3.0]),
        ("7", [7.0, 7.0, 7.0]),
        ("x + 2*y - s/2", X + 2.0 * (X + 1.0) - X / 4.0),
        ("-x**2", -(X**2)),
        ("2**-y", 0.5 ** (X + 1.0)),
        ("1/3", [1.0 / 3.0] * 3),
        ("x % 2", X % 2.0),
        ("sin(pi*x) + cos(x)*exp(-y)", np.sin(np.pi * X) + np.cos(X) * np.exp(-X - 1.0)),
        ("where(x > 0.5, 10, -10)", [-10.0, 10.0, 10.0]),
        ("where(x >= 1, y, 0) + min(x, 1) + max(s, ny)", [0.0, 3.5, 5.0]),
        ("100 * (x < 1)", [100.0, 0.0, 0.0]),
        ("atan2(y, x) + hypot(x, y) + abs(ny)", np.arctan2(X + 1, X) + np.hypot(X, X + 1) + 1.0),
        ("log(e)", [1.0] * 3),
    ],
)
def test_values(text, wanted):
    assert np.allclose(value(text), wanted, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("9 if nx == 0 and ny < 0 else 1", r"where\(x > 0"),
        ("z + 1", "unknown name 'z' in expression"),
        ("1/x", "not finite at x = 0, y = 1"),
        ("9**9**9**9", "not finite"),
        ("x.__class__", "only numbers"),
        ("__import__('os').system('true')", "only numbers|unknown name"),
        ("[x for x in (1, 2)]", "only numbers"),
        ("'a' * 3", "only numbers, names"),
        ("x.tofile('stolen')", "only numbers, names"),
        ("x := 3", "cannot be read"),
        ("where(x > 1, 1, 2, 3)", "where takes 3 values"),
        ("sin(x, y)", "sin takes 1 value"),
        ("sin(x, out=y)", "only numbers, names"),
        ("1j * x", "only numbers"),
        ("2 * |x|", r"a size is written abs\(x\)"),
        (lambda x: 1 / 0, "function <lambda> fails with ZeroDivisionError: division by zero"),
        ("0,2", "'0,2'; a number has a decimal point, not a comma: 0.2"),
    ],
)
def test_refused_in_one_line_that_names_the_key(text, message):
    before = [v.copy() for v in SITES.names.values()]
    with pytest.raises(InputError, match=message) as caught:
        value(text)
    assert str(caught.value).startswith("gap: ") and "\n" not in str(caught.value)
    assert all(np.array_equal(a, b) for a, b in zip(before, SITES.names.values(), strict=True))


@pytest.mark.parametrize(
    "text", ["(" * 400 + "x" + ")" * 400, "-" * 480 + "x", "10**10**10", "2**" * 100 + "2"]
)
def test_long_and_deep_texts_end(text):
    """What grows exponentially takes for ever."""
    try:
        assert value(text).shape == (3,)
    except InputError as error:
        assert "\n" not in str(error)


@given(st.text(alphabet="xyns0123456789.+-*/%()<>=,'\"[]{}_ abcelosinw\n", max_size=40))
def test_any_text_gives_finite_values_or_one_line(text):
    try:
        result = value(text)
    except InputError as error:
        assert str(error).startswith("gap: ")
        assert "\n" not in str(error)
    else:
        assert result.shape == (3,) and np.all(np.isfinite(result))


def test_what_overflows_is_named_and_warns_of_nothing():
    """The command line would print numpy's warnings before its line."""
    outline = Rectangle((0.0, 0.0), (8.0, 1.0)).outline()
    found = lines_of(outline)[0].switches(as_given("exp(exp(exp(exp(x))))", "gap"))
    assert all(np.all((at >= 0.0) & (at <= 1.0)) for at in found)
    line, high = Sites(np.array([[0.0], [1.0], [4.0]])), as_given("exp(exp(exp(x)))", "gap")
    assert high.near(line, 9.0)[2] == 9.0
    with pytest.raises(InputError, match="is not finite at x = 4"):
        high.at(line)
