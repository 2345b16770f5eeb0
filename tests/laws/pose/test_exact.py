import itertools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from inexact import EXACT, inexact

import servoid
from servoid import _native
from servoid.pose import exact

PACKAGE = Path(servoid.__file__).parent
SIZES = st.integers(1, 6)
NUMBERS = st.floats(-1e3, 1e3, allow_subnormal=False)
ELEMENTARY: dict[str, tuple[float, float]] = {
    "sin": (-1e3, 1e3),
    "cos": (-1e3, 1e3),
    "tan": (-1.5, 1.5),
    "arcsin": (-1.0, 1.0),
    "arccos": (-1.0, 1.0),
    "arctan": (-1e3, 1e3),
    "exp": (-50.0, 50.0),
    "expm1": (-5.0, 5.0),
    "log": (1e-9, 1e9),
}


def matrices(rows: int, columns: int) -> st.SearchStrategy[np.ndarray]:
    return arrays(np.float64, (rows, columns), elements=NUMBERS)


@st.composite
def chains(draw: st.DrawFn) -> list[np.ndarray]:
    sizes = draw(st.lists(SIZES, min_size=3, max_size=5))
    return [draw(matrices(*size)) for size in itertools.pairwise(sizes)]


@st.composite
def tables(draw: st.DrawFn) -> np.ndarray:
    return draw(matrices(draw(SIZES), draw(SIZES)))


@st.composite
def well_posed(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    size = draw(SIZES)
    dominant = np.diag(np.full(size, 1e4))
    return dominant + draw(matrices(size, size)), draw(matrices(size, draw(SIZES)))


@pytest.mark.parametrize("name", ELEMENTARY)
def test_a_function_is_numpys_up_to_rounding(name: str) -> None:
    mine, numpys = getattr(exact, name), getattr(np, name)
    x = np.linspace(*ELEMENTARY[name], 1001).reshape(7, 11, 13)
    np.testing.assert_allclose(mine(x), numpys(x), rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(mine(x[::2].T), mine(x)[::2].T)
    assert mine(float(x[1, 2, 3])) == mine(x)[1, 2, 3]


@given(NUMBERS, NUMBERS)
def test_functions_of_two_numbers_are_numpys_up_to_rounding(x: float, y: float) -> None:
    assert exact.arctan2(y, x) == pytest.approx(np.arctan2(y, x), rel=1e-15)
    assert exact.hypot(x, y) == pytest.approx(np.hypot(x, y), rel=1e-15)
    assert exact.power(abs(x), 0.3) == pytest.approx(abs(x) ** 0.3, rel=1e-14)


@given(chains())
def test_a_product_is_that_of_plain_loops_to_the_bit(factors: list[np.ndarray]) -> None:
    wanted = factors[0].tolist()
    for factor in factors[1:]:
        wanted = [[_summed(row, column) for column in factor.T.tolist()] for row in wanted]
    np.testing.assert_array_equal(exact.product(*factors), wanted)
    first, second, *_ = factors
    turned = exact.product(second.T, first.T).T
    np.testing.assert_array_equal(turned, exact.product(first, second))


def _summed(row: list[float], column: list[float]) -> float:
    total = 0.0
    for x, y in zip(row, column, strict=True):
        total += x * y
    return total


@given(tables())
def test_vectors_are_rows_or_columns(matrix: np.ndarray) -> None:
    row, column = matrix[0], matrix[:, 0]
    with_column = exact.product(matrix, row)
    with_row = exact.product(column, matrix)
    np.testing.assert_array_equal(with_column, exact.product(matrix, row[:, None])[:, 0])
    np.testing.assert_array_equal(with_row, exact.product(column[None], matrix)[0])
    assert exact.dot(row, row) == _summed(row.tolist(), row.tolist())
    assert exact.norm(row) == pytest.approx(np.linalg.norm(row), rel=1e-14)
    np.testing.assert_allclose(exact.lengths(matrix), np.linalg.norm(matrix, axis=1), rtol=1e-14)


@given(well_posed())
def test_a_solution_solves(problem: tuple[np.ndarray, np.ndarray]) -> None:
    matrix, right = problem
    found = exact.solve(matrix, right)
    np.testing.assert_allclose(matrix @ found, right, atol=1e-9)
    np.testing.assert_array_equal(exact.solve(matrix, right[:, 0]), found[:, 0])


@given(tables() | matrices(3, 5).map(np.sign))
def test_eigenvectors_are_orthonormal_and_multiply_back(matrix: np.ndarray) -> None:
    square = exact.product(matrix, matrix.T)
    values, vectors = exact.eigh(square)
    assert (np.diff(values) >= 0.0).all()
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(len(square)), atol=1e-12)
    np.testing.assert_allclose(vectors * values @ vectors.T, square, atol=1e-6)


@pytest.mark.parametrize(
    "call",
    [
        lambda: exact.product(np.ones((2, 3)), np.ones((2, 3))),
        lambda: exact.dot(np.ones(2), np.ones(3)),
        lambda: exact.solve(np.ones((2, 3)), np.ones(2)),
        lambda: exact.solve(np.eye(2), np.ones(3)),
        lambda: exact.solve(np.zeros((2, 2)), np.ones(2)),
        lambda: exact.solve(np.zeros((0, 0)), np.ones((0, 1))),
        lambda: exact.eigh(np.ones((2, 3))),
        lambda: exact.eigh(np.full((2, 2), np.nan)),
        lambda: exact.eigh(np.array([[np.inf]])),
        lambda: exact.eigh(np.ones((0, 0))),
    ],
)
def test_what_has_no_answer_is_refused(call: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r"cannot|singular|finite|empty"):
        call()


def test_what_feeds_a_result_is_computed_exactly() -> None:
    assert all((PACKAGE / place).exists() for place in EXACT)
    assert inexact(PACKAGE) == []


# The check itself is checked: a tree with a known fault must be caught.


@pytest.mark.parametrize(
    "text",
    [
        "a = np.sin(b)",
        "a = np.linalg.norm(b)",
        "a = np.einsum('ij,j', b, c)",
        "f = math.atan2",
        "from math import cos, pi",
        "from numpy.linalg import solve",
        "from numpy import sin",
        "a = b**2",
        "a **= 0.5",
        "a = pow(b, 3)",
        "a = b.dot(c)",
        "a = b @ c",
        "a @= b",
        "a = left_from_right.matrix() @ b",
        "a = left_from_right[:3, :3] @ b",
        "a = b @ left_from_right.T",
        "a = np.array(b) @ np.array(c)",
    ],
)
def test_inexact_arithmetic_is_caught(tmp_path: Path, text: str) -> None:
    file = tmp_path / "servo" / "law.py"
    file.parent.mkdir()
    file.write_text(f"import numpy as np\n\n{text}\n")
    (found,) = inexact(tmp_path, ("servo",))
    assert found.startswith("servo/law.py:3: ")
    assert found.endswith("see servoid.pose.exact")


@pytest.mark.parametrize(
    "text",
    [
        "a = exact.sin(b) + exact.dot(c, d)",
        "a = np.sqrt(b * b) + np.cross(c, d)",
        "a = math.sqrt(b) + math.radians(c)",
        "from math import pi, sqrt",
        "a = 2**31 - 1",
        "a = world_from_left @ left_from_right",
        "a = self.poses[index] @ b",
        "a = first @ pose",
        "a = (after @ before.inverse()).log()",
        "a = Pose.exp(b) @ c @ d",
        "# a = np.sin(b)",
    ],
)
def test_exact_arithmetic_is_let_through(tmp_path: Path, text: str) -> None:
    (tmp_path / "law.py").write_text(f"{text}\n")
    assert inexact(tmp_path, ("law.py",)) == []


def test_what_is_no_number_nor_an_array_of_float64_is_named() -> None:
    for one, named in ((np.zeros(3, np.float32), "float32"), ("one", "str")):
        with pytest.raises(TypeError, match=f"float64 is needed, but got .*{named}"):
            _native.exact_sin(one)  # pyright: ignore[reportArgumentType]
