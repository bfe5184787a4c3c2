"""`python -m petcontact`."""

from .commands.main import entry

entry()
