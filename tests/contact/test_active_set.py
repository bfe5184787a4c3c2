"""The active set: complementary pivots end in a solution wherever there is one, and blocks are
solved by the factors of an earlier set."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from reduced_system import coulomb

from petcontact.contact.active_set.block_factors import BlockFactors
from petcontact.contact.active_set.complementarity import complementary_guesses, lemke
from petcontact.contact.active_set.pivots import pivots
from petcontact.contact.active_set.solvers import DenseActiveSetSolver, SurrogateActiveSetSolver
from petcontact.contact.laws import Tresca
from petcontact.contact.linearisation import Linearisation
from petcontact.contact.system import Modes
from petcontact.errors import SingularMatrixError
from petcontact.linalg.dense_solver import DenseSolver


@pytest.mark.parametrize("seed", range(5))
def test_pivots_end_in_a_solution_of_every_copositive_problem(seed):
    random = np.random.default_rng(seed)
    n = random.integers(1, 30)
    root = random.normal(size=(n, n))
    matrix, offset = root @ root.T + np.triu(random.random((n, n))), random.normal(size=n)
    z = lemke(matrix, offset)
    w = offset + matrix @ z
    assert min(z.min(), w.min()) > -1e-9 and np.abs(z * w).max() < 1e-9


class Spheres:
    """Bodies of no strain but at their contacts, which are springs of compliance 1 to rigid walls;
    plane, with rigid motions."""

    matrix_free, ksp_iterations, elastic_solves, applications = False, 0, 0, 0

    def __init__(self, motion, gap, load):
        size = motion.shape[0]
        self.weight = np.ones(size)
        self.u_0 = np.column_stack([np.zeros(size), -gap])
        self.modes = Modes(motion, np.moveaxis(motion, 2, 0), load)

    def compliance(self):
        return np.eye(2 * len(self.weight))

    def apply(self, sigma):
        return sigma


def drawer(pull, offset, gap=1.0):
    """A bar from x = 0 to 1 in a slot: contacts at its four corners, unknowns u_x, u_y and its
    rotation; pulled along x, `offset` beside its middle line."""
    x, y = np.array([0.0, 1.0, 0.0, 1.0]), np.array([-0.1, -0.1, 0.1, 0.1])
    up = np.sign(y)
    motion = np.zeros((4, 2, 3))
    motion[:, 0, 0], motion[:, 0, 2] = 1.0, -y
    motion[:, 1, 1], motion[:, 1, 2] = up, up * x
    return Spheres(motion, gap * np.ones(4), pull * np.array([1.0, 0.0, -offset]))


@pytest.mark.parametrize(("near", "gap"), [(0, 0.0), (2, 1.0), (4, 1000.0)])
@pytest.mark.parametrize(("friction", "holds"), [(0.24, False), (0.27, True), (1.0, True)])
def test_a_drawer_jams_where_friction_is_more_than_its_length_over_twice_the_offset(
    friction, holds, gap, near
):
    """µ = 1/(2·2): two forces N a length apart balance the moment of the pull, 2µN >= pull."""
    system, law = drawer(1.0, 2.0, gap), coulomb(4, friction)
    ends = []
    for tau, sigma, _ in complementary_guesses(system, law, np.arange(4) < near):
        solver = DenseActiveSetSolver(system, None)
        steps = pivots(solver, law, system.u_0, system.modes, tau, sigma=sigma)
        step = list(itertools.islice(steps, 4))[-1]
        ends.append(step.wrong == 0 and not step.push.any())
        if ends[-1]:
            assert system.modes.unbalanced(step.sigma) == pytest.approx(np.zeros(3), abs=1e-9)
            break
    assert any(ends) == holds


def solved(factors, dense, active, changed, border):
    """The answer on a set whose columns `changed` are doubled, bordered by ones, and the exact
    one."""
    factor = np.where(np.isin(active, changed), 2.0, 1.0)
    size = len(active) + border
    matrix = np.zeros((size, size), order="F")
    matrix[: len(active), : len(active)] = dense[np.ix_(active, active)] * factor
    matrix[len(active) :, : len(active)] = 1.0
    matrix[: len(active), len(active) :] = 1.0
    rhs = np.cos(np.arange(size))
    answer = factors.solve(dense, active, factor[:, None], matrix, rhs)
    return answer, np.linalg.solve(matrix, rhs)


@pytest.mark.parametrize("border", [0, 1])
def test_near_blocks_are_solved_by_the_factors_of_the_first(border, monkeypatch):
    random = np.random.default_rng(3)
    dense = np.eye(80) + 0.3 * random.standard_normal((80, 80)) / np.sqrt(80)
    factors, first = BlockFactors(), np.arange(60)
    assert solved(factors, dense, first, [], border)[0] == pytest.approx(
        solved(factors, dense, first, [], border)[1], rel=1e-10
    )
    taken = []
    monkeypatch.setattr(DenseSolver, "take", lambda _, matrix: taken.append(matrix))
    for active, changed in (
        (first, [7]),
        (np.arange(2, 60), []),
        (np.arange(62), [1, 5]),
        (np.delete(np.arange(61), [4]), [9]),
    ):
        answer, exact = solved(factors, dense, active, changed, border)
        assert answer == pytest.approx(exact, rel=1e-10, abs=1e-10)
    assert not taken
    monkeypatch.undo()
    for active, matrix in ((np.arange(20, 80), dense), (first, dense.copy())):
        answer, exact = solved(factors, matrix, active, [], border)
        assert answer == pytest.approx(exact, rel=1e-10, abs=1e-10)


def test_a_singular_block_of_a_surrogate_is_named():
    """A body that nothing holds: LU gave infinite numbers, and a singular value failed on them."""

    class Rigid:
        def matrix(self):
            return np.zeros((4, 4))

        def stick_solve(self, stick, rhs):
            return rhs

    tau = np.array([[0.5, 0.0], [3.0, 1.0]])
    stick_and_slip = Linearisation.from_law(Tresca(np.ones(2), 2), tau)
    with pytest.raises(SingularMatrixError, match="row 1 of a block of T"):
        SurrogateActiveSetSolver(Rigid()).solve(stick_and_slip, np.ones((2, 2)), tau, None, tau)
