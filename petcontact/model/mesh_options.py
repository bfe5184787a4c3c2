"""What a user says about the mesh."""

from __future__ import annotations

from typing import Annotated

import pydantic

from .base import Model, Point, Positive

Order = Annotated[int, pydantic.Field(ge=0, le=5, strict=True)]
Ratio = Annotated[float, pydantic.Field(strict=True, gt=0.0, lt=1.0)]


class MeshOptions(Model):
    """Element size, order and grading.

    Attributes
    ----------
    element_size : float, optional
        h: a side of length l has round(l/h) equal elements, at least one [length].
    element_sizes : dict of part name to float
        h of single parts, over `element_size`.
    order : int, optional
        Order of the elements, 0 (constant, as in the paper; the default where `element_size` is given) to 5.
    grading : float, optional
        Ratio in (0, 1) of neighbouring elements where the mesh is graded geometrically towards corners, ends of parts
        and `graded_points`; by default no grading where `element_size` is given, else 0.35.
    levels : int
        Number of graded elements towards each such point.
    graded_points : list of points
        Further points of the boundary to grade towards [length]. On contact parts of adaptive solves they are a first
        guess of transition points.
    accuracy : float
        In the plane, where neither sizes nor order nor grading are given, the solve is adaptive: it refines until the
        estimated relative error of u_t is below this [-].
    exponent : float, optional
        In space: panels on the faces of a box shrink towards the edges with this power of their number, by default 1.4; 1
        for equal ones.
        Of the other keys `element_size` (a quarter of the shortest edge by default), `element_sizes` and `order` (0 to 3,
        by default 2) count in space; on surfaces from files the facets are the panels.
    """

    element_size: Positive | None = None
    element_sizes: dict[str, Positive] = {}  # noqa: RUF012 (frozen)
    order: Order | None = None
    grading: Ratio | None = None
    levels: Annotated[int, pydantic.Field(ge=1, le=60, strict=True)] = 12
    graded_points: tuple[Point, ...] = ()
    accuracy: Annotated[float, pydantic.Field(gt=0.0, lt=1.0)] = 1e-4
    exponent: Annotated[float, pydantic.Field(strict=True, ge=1.0, le=4.0)] | None = None

    @property
    def automatic(self) -> bool:
        """Whether nothing is said of sizes, order and grading: order and grading follow `accuracy`."""
        return self.element_size is None and not self.element_sizes and self.order is None and self.grading is None

    @property
    def graded(self) -> bool:
        """Whether elements shrink towards singular points."""
        return self.grading is not None or self.element_size is None

    @property
    def resolved_order(self) -> int:
        """The order, its default filled in: 0 on uniform meshes as in the paper, 3 on graded ones."""
        if self.order is not None:
            return self.order
        return 0 if self.element_size is not None else 3

    @property
    def resolved_grading(self) -> float:
        """The ratio, its default filled in."""
        return self.grading if self.grading is not None else 0.35
