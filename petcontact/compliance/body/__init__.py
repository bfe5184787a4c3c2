"""One elastic body eliminated to its contact nodes, which carry free traction vectors: u_c = u_0 +
S t_c + R α.

Rigid motions R that no known displacement holds border the system,

    [[A, R], [RᵀW, 0]] [x, β] = [b, 0],

so that one factorisation serves; equilibrium of the tractions, RᵀW t + F = 0, is an equation for
whoever chooses t_c and α. The multipliers β measure how far the discrete tractions are from what
the integral equations call equilibrium.
"""
