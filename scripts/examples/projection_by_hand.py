"""The paper's Algorithm 1 in numpy on S and u_0: u = u_0 + Sσ with Tresca's law, the Robin
parameter fixed."""

from pathlib import Path

import numpy as np

from petcontact import load, operators, solve

block = load(
    Path(__file__).resolve().parents[2] / "configs/example1.toml", {"mesh.element_size": 0.4}
)
found = operators(block)
S, u_0, bound = found.S, found.u_0.ravel(), 150.0
rho = 2.0 / np.abs(np.diag(S)).mean()  # of the size of the stiffness at a node
robin = np.linalg.inv(np.eye(len(u_0)) + rho * S)
u, sigma = u_0.copy(), np.zeros_like(u_0)
count, change = 0, 1.0
while change > 1e-8 and count < 1000:
    target = -np.clip(rho * u - sigma, -bound, bound)  # σ of the friction law at ρu - σ
    new = robin @ (rho * u + target - rho * u_0)  # σ + ρu = target + ρu, u = u_0 + Sσ
    new_u = u_0 + S @ new
    change = np.abs(new - sigma).max() / bound
    u, sigma, count = new_u, new, count + 1
reference = solve(block, method="semismooth-newton").pairs["bottom"].sigma_t[:, 0]
print(
    f"{count} iterations, σ_t differs from that of `solve` by "
    f"{np.abs(sigma - reference).max():.1e} of {bound:g}"
)
result = np.abs(sigma - reference).max() / bound
