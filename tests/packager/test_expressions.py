"""Expressions of t: right values, helpful refusals, and nothing that reaches beyond arithmetic."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from build_fmu.errors import UserError
from build_fmu.run.expressions import compile_expression


@pytest.mark.parametrize(
    ("text", "t", "value"),
    [
        ("2", 0, 2.0),
        ("-t**2", 3, -9.0),
        ("2*sin(pi*t) + cos(0)", 0.5, 3.0),
        ("1 if t < 1 else 0", 0.5, 1.0),
        ("1 if 0.2 <= t < 1 and not t == 0.7 else 0", 0.7, 0.0),
        ("min(t, 1, 2) + max(0, -t)", 5, 1.0),
        ("sign(t) * abs(t) + floor(t)", -1.5, -3.5),
        ("exp(0) + sqrt(4) + tan(0)", 0, 3.0),
        (" (1\n+ 1) ", 0, 2.0),
        ("t > 1", 2, 1.0),
    ],
)
def test_values(text, t, value):
    assert compile_expression(text)(t) == pytest.approx(value, abs=1e-15)


@given(st.floats(-1e6, 1e6))
def test_a_number_is_itself(number):
    assert compile_expression(repr(number))(0.0) == number


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "cannot read"),
        ("2*", "cannot read"),
        ("sine(t)", "did you mean 'sin'"),
        ("tt", "unknown name 'tt'; did you mean 't'"),
        ("sin", "requires an argument"),
        ("sin(1, 2)", "requires one argument, got 2"),
        ("min(1)", "requires two or more"),
        ("sin()", "requires one argument, got 0"),
        ("__import__('os').system('true')", "not allowed"),
        ("open('x')", "unknown function"),
        ("().__class__", "not allowed"),
        ("'a' * 9", "not allowed"),
        ("[t for t in (1, 2)]", "not allowed"),
        ("(lambda: 1)()", "not allowed"),
        ("sin(x=1)", "not allowed"),
        ("True", "not allowed"),
        ("t % 2", "not allowed"),
        ("1 << 99", "not allowed"),
        ("t := 1", "cannot read"),
        ("(t := 1)", "not allowed"),
        ("1j", "not allowed"),
        ("(" * 300 + "1" + ")" * 300, "cannot read"),
        ("-" * 1500 + "1", "cannot read"),
        ("1+" * 2000 + "1", "characters"),
    ],
)
def test_refusals(text, sentence):
    with pytest.raises(UserError, match=sentence.replace("(", r"\(")):
        compile_expression(text)(0.0)


@pytest.mark.parametrize("text", ["1/t", "sqrt(-1)", "9**9**9", "exp(1000)", "(-1)**0.5", "sin((-1)**0.5)", "1e999", "floor(1e999)"])
def test_values_that_are_no_finite_number(text):
    with pytest.raises(UserError, match="t = 0 s"):
        compile_expression(text)(0.0)


@given(st.text(max_size=60))
def test_any_text_gives_a_number_or_a_sentence(text):
    try:
        assert math.isfinite(compile_expression(text)(0.3))
    except UserError:
        pass
