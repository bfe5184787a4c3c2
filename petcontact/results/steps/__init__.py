"""Solutions of bodies and load steps: what they hold, their verdict, files and figures."""
