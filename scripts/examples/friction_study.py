"""How far a pushed block slips, over the friction coefficient: problems that differ in one
value."""

from petcontact import (
    Contact,
    Displacement,
    Material,
    MeshOptions,
    Problem,
    Rectangle,
    Traction,
    solve,
)


def block(mu):
    return Problem(
        material=Material(10_000.0, 0.3),
        geometry=Rectangle((0.0, 0.0), (8.0, 4.0)),
        mesh=MeshOptions(element_size=0.25, order=1),
        boundary=[
            Contact("bottom", normal="unilateral", friction_coefficient=mu),
            Displacement("top", (0.02, -0.02)),
            Traction("left", (0.0, 0.0)),
            Traction("right", (0.0, 0.0)),
        ],
    )


shares = {}
for mu in (0.1, 0.3, 0.5, 0.7):
    pair = solve(block(mu)).pairs["bottom"]
    shares[mu] = float(pair.weight[pair.state == 1].sum() / pair.weight.sum())
    print(
        f"µ = {mu}: {shares[mu]:.0%} slips, friction {abs(pair.force[0]):.1f} of µN = "
        f"{mu * abs(pair.force[1]):.1f}"
    )
result = shares[0.3]
