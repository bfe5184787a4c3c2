"""The border's old place."""

from .active_set.rigid_modes import RigidModeConstraint

Border = RigidModeConstraint
