"""Friction laws, rules for rho and the methods; they see a body only as u = u_0 + S sigma."""
