"""The border's old place."""

from .active_set.rigid_modes import Border as Border
