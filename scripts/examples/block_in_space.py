"""A block in three dimensions pushed along two directions over a foundation with friction; what
each part carries."""

from petcontact import Box, Contact, Displacement, Material, MeshOptions, Problem, Traction, solve

push = (200.0, 100.0, 0.0)
problem = Problem(
    material=Material(10_000.0, 0.3),
    geometry=Box((0.0, 0.0, 0.0), (8.0, 4.0, 4.0)),
    mesh=MeshOptions(element_size=2.0, order=1),
    boundary=[
        Contact("bottom", friction_bound=150.0),
        Displacement("top", (0.0, 0.0, 0.0)),
        Traction("left", push),
        *(Traction(part, (0.0, 0.0, 0.0)) for part in ("right", "front", "back")),
    ],
)
solution = solve(problem)
for part, force in solution.reactions().items():
    print(f"{part:<7} {force.round(1)}")
balance = sum(solution.reactions().values())
print(f"their sum is {balance.round(2)}: the error of the mesh")
result = float(solution.reactions()["bottom"][0] + solution.reactions()["top"][0]) / -(
    push[0] * 16.0
)
