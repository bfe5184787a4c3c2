"""Bodies eliminated to their contact parts: u = u_0 + S sigma."""
