"""Checks of meshes before a solve and of every converged increment, and what each finding means.

Small residuals are necessary, not sufficient. An ill-conditioned body has small residuals with any
tractions, and the residuals of the integral equations do not show elements that are too large for
the thickness of the body. The checks measure that by other quantities: the size of elements over
the thickness, the digits that the elimination keeps, the equilibrium of the tractions on each body,
and overlaps of surfaces at nodes and between nodes. They also warn of motions that are not small.
"""
