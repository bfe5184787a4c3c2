"""One elastic body, eliminated to its contact nodes with free tractions: u_c = u_0 + S t_c + R α.

R are the rigid motions that no known displacement holds. They border the system,

    [[A, R], [RᵀW, 0]] [x, β] = [b, 0],

so that one factorisation is enough. Callers choose t_c and α; they must satisfy the equilibrium of
the tractions, RᵀW t + F = 0. The multipliers β measure how far the discrete tractions are from the
equilibrium that the integral equations imply.
"""
