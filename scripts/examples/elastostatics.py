"""Boundary elements without contact: a bar of given conditions, its equations checked, stress
inside and on the boundary."""

import numpy as np

from petcontact import Displacement, Material, MeshOptions, Problem, Rectangle, Traction, operators

beam = Problem(
    material=Material(1000.0, 0.3, "stress"),
    geometry=Rectangle((0.0, 0.0), (10.0, 1.0)),
    mesh=MeshOptions(element_size=0.5, order=2),
    boundary=[
        Displacement("left", (0.0, 0.0)),
        Traction("right", (0.0, "-6*y*(1 - y)")),
        Traction("bottom", (0.0, 0.0)),
        Traction("top", (0.0, 0.0)),
    ],
)
body = operators(beam).body
u, t = body.solve()  # (n, 2) each, at the nodes body.mesh.x
defect = 0.5 * u.ravel() + body.H @ u.ravel() - body.G @ t.ravel()
state = body.state_at([[5.0, 0.9], [5.0, 0.5], [5.0, 1.0]], u, t)
print(f"½u + Hu - Gt is {np.abs(defect).max():.1e}")
print(f"deflection at the end {u[body.mesh.nodes_of('right'), 1].mean():.3f}, of a beam -4.025")
print(f"bending stress at y = 0.9, 0.5 and 1: {state.stress[:, 0].round(2)}, of a beam [24, 0, 30]")
result = state.stress[2, 0]
