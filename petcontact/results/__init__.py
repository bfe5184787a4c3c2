"""Solutions, their files and figures."""
