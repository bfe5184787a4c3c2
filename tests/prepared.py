"""Problems, discretised and prepared as the pipeline does it, for tests of single layers."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from petcontact import Method, Problem
from petcontact.arrays import Array
from petcontact.bem.dense_assembly import fill_dense
from petcontact.bem.operators import BoundaryOperators
from petcontact.compliance.layer.kernel import Strip, strips
from petcontact.compliance.layer.operator import LayerOperator
from petcontact.contact.methods.registry import method_of
from petcontact.contact.state import ContactState
from petcontact.contact.system import ContactSystem
from petcontact.pipeline.choice import COMPRESSIONS
from petcontact.pipeline.eliminate import operators_of
from petcontact.pipeline.pose.discretise import discretise
from petcontact.pipeline.run import prepare
from petcontact.pipeline.steps.increment import Increment
from petcontact.pipeline.steps.start import first_iterate
from petcontact.pipeline.steps.step_loop import first_increment


def operators(problem: Problem, number: int = 0) -> BoundaryOperators:
    """Of one body."""
    return operators_of(discretise(problem), number)[0]


def filled(ops: BoundaryOperators) -> tuple[Array, Array, Array]:
    """A_0 (d n, d n), G_Ct times the traction scale (d n, m k) and the loads (d n, K), by
    `fill_dense`."""
    n, d = ops.mesh.x.shape
    m, k = ops.data.contact_shape
    system = np.empty((n, d, n, d))
    contact = np.zeros((m * k, n, d))
    loads = np.zeros((ops.data.states, n, d))
    fill_dense(ops, np.arange(n), system, contact, loads)
    return system.reshape(d * n, -1).T, contact.reshape(m * k, -1).T, loads.reshape(-1, d * n).T


def strips_of(ops: BoundaryOperators) -> list[Strip]:
    """Of the contact nodes of one body."""
    return list(strips(ops, ops.data.contact_nodes, ops.data.contact_frame))


def layer_of(ops: BoundaryOperators) -> LayerOperator:
    """T over the contact nodes of one body."""
    nodes = ops.data.contact_nodes
    return LayerOperator(strips_of(ops), ops.mesh.weight[nodes], ops.mesh.x[nodes])


class Posed:
    """A prepared problem, and the contact system of its first increment, as a method sees it."""

    def __init__(self, problem: Problem, comm=None, **keywords) -> None:
        self.prepared = prepare(problem, comm, **keywords)
        self.bodies, self.law = self.prepared.system, self.prepared.discrete.law
        self.body = self.bodies.bodies[0]
        self.operators, self.weight = self.body.operators, self.bodies.weight

    @functools.cached_property
    def increment(self) -> Increment:
        return first_increment(self.prepared)

    @property
    def system(self) -> ContactSystem:
        return self.increment.system

    @property
    def bound(self) -> Array:
        """g (m,) of Tresca's law."""
        return self.law.bound

    def iterate(self, method: Method) -> ContactState:
        """The outcome of a method of the package on the same system."""
        discrete = self.prepared.discrete
        discrete = replace(discrete, problem=discrete.problem.model_copy(update={"method": method}))
        prepared = replace(self.prepared, discrete=discrete, method=method_of(method, None, method))
        increment = first_increment(replace(prepared, start=first_iterate(prepared)))
        increment.system = self.system
        return increment.solved()

    def boundary(self, sigma: Array) -> tuple[Array, Array]:
        """u and t (n, d) of the only body, which is held, at the end of the increment."""
        tractions = self.bodies.tractions(0, sigma)
        return self.body.boundary(self.increment.shares, tractions, np.zeros(0))

    def close(self) -> None:
        self.prepared.close()


def compressed_from(smallest: int, name: str, monkeypatch) -> None:
    """Bodies of more nodes are compressed, which is said to cost nothing."""
    way = replace(COMPRESSIONS[name], smallest=smallest, seconds=lambda mesh: 0.0)
    monkeypatch.setitem(COMPRESSIONS, name, way)
