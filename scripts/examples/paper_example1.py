"""Example 1 of the paper on a coarse mesh: the projection method by three rules for ρ, and a Newton
method."""

from pathlib import Path

from petcontact import Method, load, solve

config = Path(__file__).resolve().parents[2] / "configs/example1.toml"
block = load(config, {"mesh.element_size": 0.4})
iterations = {}
for rule in ("fixed", "self-adaptive", "modified"):
    solution = solve(block, method=Method(name="projection", rule=rule, rho=1000.0))
    iterations[rule] = solution.iterations
newton = solve(block, method="semismooth-newton")
iterations["semismooth Newton"] = newton.iterations
for name, count in iterations.items():
    print(f"{name:<18} {count} iterations")
result = newton.iterations
