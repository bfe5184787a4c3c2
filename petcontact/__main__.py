"""`python -m petcontact`."""

from .cli import entry

entry()
