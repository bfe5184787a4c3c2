"""Contact laws, rules for ρ, and contact methods; they see a body only as u = u_0 + S σ."""
