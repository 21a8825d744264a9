"""Expressions of the time `t`, such as `2*sin(pi*t) if t < 1 else 0`; only permitted syntax is evaluated."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable

from build_fmu.errors import UserError, did_you_mean
from build_fmu.run.branches import Series, series_of
from build_fmu.run.taylor import Interval

FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "exp": math.exp, "sqrt": math.sqrt, "abs": abs,
    "sign": lambda x: float((x > 0) - (x < 0)), "min": min, "max": max, "floor": lambda x: float(math.floor(x)),
}  # fmt: skip
MANY_ARGUMENTS = {"min", "max"}
CONSTANTS = {"pi": math.pi}
OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.USub, ast.UAdd, ast.Not, ast.And, ast.Or,
             ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)  # fmt: skip
LONGEST = 2000  # characters


class Expression:
    """A function of t (s): its value, and its Taylor series over a range of time."""

    def __init__(self, value: Callable[[float], float], tree: ast.expr) -> None:
        """Takes the compiled function and its checked tree."""
        self._value = value
        self._tree = tree
        self._series: Series | None = None

    def __call__(self, t: float) -> float:
        """Returns the value; raises UserError where it is not finite."""
        return self._value(t)

    @property
    def is_constant(self) -> bool:
        """Returns whether t does not occur in it."""
        return not any(isinstance(node, ast.Name) and node.id == "t" for node in ast.walk(self._tree))

    def series(self, low: float, high: float, order: int) -> list[Interval]:
        """Returns the coefficients over the range; raises Split where the range must be divided."""
        if self._series is None:
            self._series = series_of(self._tree)
        return self._series(low, high, order)


def compile_expression(text: str) -> Expression:
    """Returns the function of t (s); raises UserError for invalid text, and at a call for a non-finite value."""
    if len(text) > LONGEST:
        raise UserError(f"the expression has {len(text)} characters; at most {LONGEST} are allowed")
    try:
        tree = ast.parse(text.strip(), mode="eval")
        _check(tree.body, text)
        code = compile(ast.fix_missing_locations(_Floats().visit(tree)), "<expression>", "eval")
    except SyntaxError as error:
        where = f" at column {error.offset}" if error.offset else ""
        raise UserError(f"cannot read the expression '{text}'{where}") from None
    except OverflowError:
        raise UserError(f"cannot read the expression '{text[:60]}': a number is too large") from None
    except (RecursionError, MemoryError, ValueError):
        raise UserError(f"cannot read the expression '{text[:60]}': nested too deeply") from None
    names = {"__builtins__": {}, **FUNCTIONS, **CONSTANTS}

    def value(t: float) -> float:
        try:
            result = eval(code, names, {"t": t})  # checked nodes only, no builtins
        except (ArithmeticError, ValueError, TypeError) as error:
            raise UserError(f"'{text}' has no value at t = {t:g} s: {error.args[-1]}") from None
        if isinstance(result, complex) or not math.isfinite(result):
            raise UserError(f"'{text}' has no finite real value at t = {t:g} s")
        return float(result)

    return Expression(value, tree.body)


def _check(node: ast.AST, text: str) -> None:
    if isinstance(node, ast.Name):
        return _check_name(node.id, text)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        _check_call(node.func.id, len(node.args), text)
        for argument in node.args:
            _check(argument, text)
        return
    # bool is a subclass of int, but not a number here
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return
    operators = node.ops if isinstance(node, ast.Compare) else [node.op] if isinstance(node, ast.BinOp | ast.UnaryOp | ast.BoolOp) else []
    if isinstance(node, ast.IfExp) or operators and all(isinstance(op, OPERATORS) for op in operators):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.expr):
                _check(child, text)
        return
    piece = ast.get_source_segment(text.strip(), node) or type(node).__name__
    raise UserError(
        f"'{text}': '{piece}' is not allowed; use t, pi, numbers, + - * / **, comparisons, 'a if b else c' and {', '.join(FUNCTIONS)}"
    )


def _check_name(name: str, text: str) -> None:
    if name in FUNCTIONS:
        raise UserError(f"'{text}': the function {name} requires an argument in parentheses")
    if name not in ("t", *CONSTANTS):
        raise UserError(f"'{text}': unknown name '{name}'{did_you_mean(name, ['t', *CONSTANTS, *FUNCTIONS])}")


def _check_call(name: str, count: int, text: str) -> None:
    if name not in FUNCTIONS:
        raise UserError(f"'{text}': unknown function '{name}'{did_you_mean(name, FUNCTIONS)}")
    if (count < 2) if name in MANY_ARGUMENTS else (count != 1):
        wanted = "two or more arguments" if name in MANY_ARGUMENTS else "one argument"
        raise UserError(f"'{text}': {name} requires {wanted}, got {count}")


class _Floats(ast.NodeTransformer):
    """Converts every number to a double, so that 9**9**9 overflows instead of exhausting the memory."""

    def visit_Constant(self, node: ast.Constant) -> ast.Constant:
        return ast.copy_location(ast.Constant(float(node.value)), node)
