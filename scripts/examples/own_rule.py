"""A rule of one's own for the Robin parameter ρ of the projection method, beside the package's."""

from pathlib import Path

from petcontact import load, solve


class Geometric:
    """ρ_(k+1) is the geometric mean of ρ_k and w_k = ‖Δσ_t‖ / ‖Δu_t‖."""

    def update(self, rho, balance):
        return (rho * balance) ** 0.5


block = load(
    Path(__file__).resolve().parents[2] / "configs/example1.toml", {"mesh.element_size": 0.4}
)
own = solve(block, rule=Geometric())
theirs = solve(block)
print(
    f"{own.provenance.rule}: {own.iterations} iterations to ρ = {own.last.rho:.0f}; {theirs.provenance.rule}: "
    f"{theirs.iterations}"
)
result = abs(own.contact.u_t - theirs.contact.u_t).max() / abs(theirs.contact.u_t).max()
