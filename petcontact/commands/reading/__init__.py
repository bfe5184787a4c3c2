"""Commands that read result files."""
