"""Methods, rules and formulations side by side."""
