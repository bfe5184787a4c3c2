"""The push at which a block under its weight begins to slide, by bisection: µ times its weight."""

from petcontact import (
    Contact,
    Material,
    MeshOptions,
    Problem,
    Rectangle,
    Traction,
    VolumeLoads,
    solve,
)

mu, weight = 0.4, 2.0  # of a block of area 2 and unit density under unit gravity


def holds(push):
    block = Problem(
        material=Material(1000.0, 0.3, density=1.0),
        geometry=Rectangle((0.0, 0.0), (2.0, 1.0)),
        mesh=MeshOptions(element_size=0.25, order=1),
        loads=VolumeLoads(acceleration=(push / weight, -1.0)),
        boundary=[
            Contact("bottom", normal="unilateral", friction_coefficient=mu),
            *(Traction(part, (0.0, 0.0)) for part in ("left", "right", "top")),
        ],
    )
    return solve(block).converged


low, high = 0.0, 2.0
while high - low > 0.02:
    middle = 0.5 * (low + high)
    low, high = (middle, high) if holds(middle) else (low, middle)
print(f"slides between {low:.3f} and {high:.3f}; µ times the weight is {mu * weight:.3f}")
result = 0.5 * (low + high)
