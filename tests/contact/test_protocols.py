"""Laws, methods and rules of one's own, on a small dense system, against the package's own and an
optimiser; and what of displacements and tractions is round-off."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from dataclasses import dataclass

import numpy as np
import pytest
import scipy
from half_space import half_plane, pressed
from reduced_system import ReducedSystem, coulomb

import petcontact.contact
from petcontact import InputError, Method
from petcontact.contact.criterion import Criterion, displaced_by, natural_residuals
from petcontact.contact.iteration import Iteration
from petcontact.contact.law_protocol import OPEN, SLIP, STICK, bound_excess
from petcontact.contact.laws import Tresca
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.methods.projection import Projection
from petcontact.contact.methods.registry import ContactNodes, law_of, method_of
from petcontact.contact.rho_rules import Fixed, Modified, SelfAdaptive
from petcontact.contact.state import ContactState, History

COUNT = 30


def cylinder(shift=0.05):
    """A rigid parabola pushed into a half plane without coupling: S is symmetric."""
    x, weight, matrix = half_plane(COUNT, 1.5)
    system = ReducedSystem(
        np.column_stack([np.full(COUNT, -shift), 0.2 - 0.5 * x**2]), matrix, weight
    )
    return x, system, matrix


class Adhesion:
    """Tresca friction at all nodes, and a normal traction that pulls by at most a strength; open,
    it goes on to pull so."""

    k, groups = 2, (slice(0, 1), slice(1, 2))

    def __init__(self, strength, bound):
        self.least = np.column_stack([-bound, -strength])
        self.most = np.column_stack([bound, np.full(len(bound), np.inf)])

    def project(self, tau):
        return np.clip(tau, self.least, self.most)

    def linearise(self, tau):
        return np.eye(2) * ((tau > self.least) & (tau < self.most))[:, :, None]

    def states(self, tau):
        slips = np.abs(tau[:, 0]) >= self.most[:, 0]
        # both components have pieces of their own: open nodes that slip, and which way, are told
        # apart by Newton's constants
        return np.where(tau[:, 1] < self.least[:, 1], OPEN, np.where(slips, SLIP, STICK)).astype(
            np.int8
        )


@dataclass
class GradientProjection:
    """σ ← -Π(ρ(u_0 + Sσ) - σ): the plainest of methods, for ρ below 2/‖S‖ and a symmetric S."""

    rho: float

    def __call__(self, system, law, iteration):
        sigma, history = np.zeros_like(system.u_0), History()
        for _ in range(iteration.max_iterations):
            v = system.u_0 + system.apply(sigma)
            new = -law.project(self.rho * v - sigma)
            change = float(np.abs(new - sigma).max() / (np.abs(new).max() or 1.0))
            sigma = new
            history.add(self.rho, self.rho, change, 0.0, 0)
            if change <= iteration.criterion.tolerance:
                v = system.u_0 + system.apply(sigma)
                return ContactState(
                    v, sigma, self.rho, True, f"change {change:.1e}", history, law=law
                )
        return ContactState(v, sigma, self.rho, False, "max_iterations reached", history, law=law)


class HalfWay:
    """ρ_{k+1} = √(ρ_k w_k)."""

    def update(self, rho, balance):
        return (rho * balance) ** 0.5


def iteration(tolerance=1e-10, limit=20_000):
    return Iteration(Criterion(tolerance), limit)


@pytest.mark.parametrize("strength, bound", [(0.05, 0.0), (0.02, 0.2)])
def test_a_law_with_adhesion_is_what_an_optimiser_finds(strength, bound):
    """The law is that of a potential: σ minimises ½σᵀSσ + σᵀu_0 over |σ_t| <= g, σ_n <=
    strength."""
    _, system, matrix = cylinder()
    law = Adhesion(np.full(COUNT, strength), np.full(COUNT, bound))
    root = np.linalg.cholesky(0.5 * (matrix + matrix.T)).T
    least = np.tile([-bound - 1e-300, -np.inf], COUNT)
    most = np.tile([bound + 1e-300, strength], COUNT)
    target = -np.linalg.solve(root.T, system.u_0.ravel())
    exact = scipy.optimize.lsq_linear(
        root, target, (least, most), method="bvls", tol=1e-14
    ).x.reshape(-1, 2)
    assert (exact[:, 1] == strength).any() and (exact[:, 1] < 0.0).any()
    for method in (
        SemismoothNewton(),
        method_of(Method(rule="modified", tolerance=1e-10)),
        method_of(GradientProjection(1.9 / np.linalg.norm(matrix, 2))),
    ):
        state = method(system, law, iteration())
        assert state.converged, state.reason
        assert np.abs(state.sigma - exact).max() < 1e-6 * np.abs(exact).max()
        assert bound_excess(law, state.sigma) <= 1e-6


def test_methods_by_name_class_and_object():
    table = Method(rule="fixed", rho=7.0, omega=1.5)
    for given in ("projection", Projection):
        found = method_of(given, options=table)
        assert isinstance(found, Projection) and (found.rho, found.omega) == (7.0, 1.5)
        assert isinstance(found.rule, Fixed)
    assert isinstance(method_of(SemismoothNewton), SemismoothNewton)
    own = GradientProjection(1.0)
    assert method_of(own) is own
    assert isinstance(method_of(table, "self-adaptive").rule, SelfAdaptive)
    assert isinstance(method_of("projection", Modified).rule, Modified)
    rule = HalfWay()
    assert method_of(table, rule).rule is rule


@pytest.mark.parametrize(
    ("given", "rule", "why"),
    [
        ("newton", None, "newton"),
        (3, None, "got 3"),
        (GradientProjection, None, "give an object"),
        ("semismooth-newton", "fixed", "no ρ"),
        (GradientProjection(1.0), "fixed", "has its own"),
        ("projection", 3, "update"),
        ("projection", HalfWay, "update"),
        ("projection", "half-way", "half-way"),
    ],
)
def test_what_is_no_method_or_rule_is_one_line(given, rule, why):
    with pytest.raises(InputError, match=why) as error:
        method_of(given, rule)
    assert "\n" not in str(error.value)


def test_laws_by_object_and_function():
    x, system, _ = cylinder()
    given, own = coulomb(COUNT, 0.3), Adhesion(np.zeros(COUNT), np.ones(COUNT))
    places, normal = np.column_stack([x, 0.0 * x]), np.tile([0.0, -1.0], (COUNT, 1))
    nodes = ContactNodes(places, normal, system.weight, {"bottom": slice(0, COUNT)}, given)
    assert law_of(None, nodes) is given and law_of(own, nodes) is own
    made = law_of(lambda n: Adhesion(0.1 * n.x[:, 0] ** 2, np.ones(len(n.weight))), nodes)
    assert np.array_equal(-made.least[:, 1], 0.1 * x**2)
    for wrong, why in (
        (Tresca(np.ones(COUNT)), "k = 1"),
        (Adhesion(np.ones(3), np.ones(3)), "shape"),
        (HalfWay(), "project"),
        (lambda n: HalfWay(), "project"),
        (3.0, "has no k"),
    ):
        with pytest.raises(InputError, match=why):
            law_of(wrong, nodes)


def test_examples_in_docstrings_run():
    """They are there where a reader looks first: laws, the projection, the protocol of systems."""
    attempted = {}
    for module in pkgutil.walk_packages(petcontact.contact.__path__, "petcontact.contact."):
        result = doctest.testmod(importlib.import_module(module.name))
        assert result.failed == 0
        attempted[module.name.removeprefix("petcontact.contact.")] = result.attempted
    for name in ("laws", "law_protocol", "friction_law", "system", "methods.registry"):
        assert attempted[name] > 0, name


@pytest.mark.parametrize(
    "beyond, holds", [(-1e-3, True), (-1e-6, True), (1e-9, False), (1e-6, False), (1e-3, False)]
)
def test_equilibrium_is_to_round_off_or_refused(beyond, holds):
    """A cylinder pushed by µP(1 + ε): what is converged is in equilibrium to 1e-10; just beyond the
    limit nothing is."""
    x, weight, matrix = half_plane(COUNT, 1.5)
    law = coulomb(COUNT, 0.3)
    system = pressed(matrix, weight, 0.5 * x**2, (0.15 * (1.0 + beyond), 0.5))
    for method in (SemismoothNewton(), Projection(Modified(), 1.0, 1.5)):
        state = method(system, law, iteration(1e-6, 300))
        assert state.converged == holds, state.reason
        if holds:
            assert np.abs(system.modes.unbalanced(state.sigma)).max() <= 1e-10
            assert bound_excess(law, state.sigma) <= 1e-6


def test_residuals_are_of_each_pair_by_its_own_tractions():
    """Nodes that press lightly and are wrong by a half are not lost beside a pair that presses a
    million times harder."""
    m = 4
    law = coulomb(2 * m, 0.3)
    pressure = np.repeat([1.0, 1e-6], m)
    system = ReducedSystem(
        np.column_stack([np.zeros(2 * m), pressure]), np.eye(4 * m), np.ones(2 * m)
    )
    sigma = np.column_stack([np.zeros(2 * m), -pressure])
    v = system.u_0 + sigma
    pairs = slice(0, m), slice(m, 2 * m)
    assert max(natural_residuals(law, system, v, sigma, pairs)) < 1e-12
    sigma[-1, 1] *= 0.5
    v = system.u_0 + sigma
    assert natural_residuals(law, system, v, sigma)[1] < 1e-6
    assert 0.1 < natural_residuals(law, system, v, sigma, pairs)[1] < 1.0
    sigma[m:], v = 0.0, system.u_0 * 1.0
    v[:m] += sigma[:m]
    assert natural_residuals(law, system, v, sigma, pairs)[1] == 1.0


@pytest.mark.parametrize("overlap", [1e-18, 1e-6])
def test_components_have_the_round_off_of_the_vector_they_belong_to(overlap):
    """Bodies that just touch: tangential displacements of 1e-20 beside gaps of .05 say nothing; an
    overlap without pressure does."""
    apart = np.array([[1e-20, overlap], [-2e-20, -0.05]])
    touching = ReducedSystem(apart, np.eye(4), np.ones(2))
    residuals = natural_residuals(coulomb(2, 0.3), touching, touching.u_0, np.zeros((2, 2)))
    assert residuals == ((0.0, 0.0) if overlap < 1e-9 else (pytest.approx(0.0), 1.0))


def test_a_pair_whose_displacement_others_take_back_is_measured_by_its_own_tractions():
    """Two pairs on one body that press on each other: the first one does not move, and is
    strained; a light one that moves is measured by how it moves."""
    compliance = np.array([[1.0, 0.5], [0.5, 1.0]])
    held = ReducedSystem(np.zeros((2, 1)), compliance, np.ones(2))
    pairs = [slice(0, 1), slice(1, 2)]
    sigma = np.array([[-1.0], [2.0]])  # S σ = (0, 1.5)
    moved = displaced_by(held, held.apply(sigma), sigma, pairs)
    assert moved.ravel() == pytest.approx([-1.0, 1.5])
    sigma = np.array([[1.0], [2.0]])
    assert displaced_by(held, held.apply(sigma), sigma, pairs) == pytest.approx(held.apply(sigma))
