"""What is asked of meshes before they are solved on and of every converged increment, beyond the
residuals of its equations.

Small residuals are necessary only: of an ill-conditioned body they are small whatever the tractions
are, and those of the integral equations do not see elements that are too large for the thickness
behind them. Other measures see it: how large the elements are next to the thickness, how many
digits the elimination keeps, whether the tractions of each body are in equilibrium, and whether
surfaces overlap, at nodes and between them. Motions that are not small are warned of.
"""
