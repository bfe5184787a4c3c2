"""How a problem is discretised and solved: the mesh, the kind of operator, the method and its
parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

import pydantic

from ...errors import InputError
from ...runtime.petsc_options import refused_in_config
from .base import Model, Point, Positive, one_of

METHODS = {
    "projection": "projection",
    "operator-robin": "operator_robin",
    "semismooth-newton": "newton",
    "tao": "tao",
}
"""Methods by name, and the module of contact/methods/ whose `build` makes each."""
DEFAULT_METHOD = "semismooth-newton"
RULES = {
    "fixed": "Fixed",
    "self-adaptive": "SelfAdaptive",
    "modified": "Modified",
    "modified-safeguarded": "ModifiedSafeguarded",
}
"""Rules for ρ by name, and the class of contact/rho_rules that each is."""
DEFAULT_RULE = "modified"
READ_BY = {
    "rho": ("projection",),
    "omega": ("projection", "operator-robin"),
    "tau": ("self-adaptive", "modified", "modified-safeguarded"),
    "max_changes": ("self-adaptive", "modified", "modified-safeguarded"),
    "change_test": ("self-adaptive", "modified", "modified-safeguarded"),
    "rule": ("projection",),
}
"""Keys of `[method]` that only some methods, or some rules of the projection method, read."""
Count = Annotated[int, pydantic.Field(ge=0, le=10**9, strict=True)]


def _option(value: object) -> bool | int | float | str:
    if isinstance(value, (bool, int, float, str)):
        return value
    raise ValueError("must be text, a number or true/false")


def _option_name(name: object) -> str:
    if (
        isinstance(name, str)
        and name[:1].isalpha()
        and name.isascii()
        and name.replace(".", "_").isidentifier()
    ):
        return name
    raise ValueError("must be the name of a PETSc option without its dash")


def checked_options(
    table: Mapping[str, bool | int | float | str],
) -> dict[str, bool | int | float | str]:
    """Options of PETSc that a config may set."""
    if reason := refused_in_config(table):
        raise InputError(reason)
    return dict(table)


Options = Annotated[
    dict[
        Annotated[str, pydantic.BeforeValidator(_option_name)],
        Annotated[bool | int | float | str, pydantic.BeforeValidator(_option)],
    ],
    pydantic.AfterValidator(checked_options),
]
"""PETSc options without the leading dash."""


class Method(Model):
    """The `[method]` table.

    In a config::

        [method]
        rule = "modified"
        rho = 1.0

    Attributes
    ----------
    name : key of METHODS, optional
        The method; by default the projection method of the paper where a rule is named, else the
        default of the package.
    rule : key of RULES, optional
        How ρ changes (projection method only).
    rho : float, optional
        First value of ρ, ρ_0 > 0 [stress/length]; by default that of smooth tractions, ‖σ‖/‖Sσ‖.
    omega : float
        Relaxation ω in (0, 2) [-].
    tau : float
        τ > 0: half width of the window in which ρ is kept, and growth of ρ outside of it [-].
    max_changes : int
        c_max: how many changes of ρ are by 1 + τ; later ones are smaller.
    change_test : {"ratio", "literal"}
        What counts as a change of ρ: w_k/ρ_k outside the window, or w_k itself, as the paper
        prints.
    tolerance : float
        Tolerance of the stopping criterion [-]. An adaptive solve takes a smaller one on its last
        mesh where the accuracy needs it, unless this key is given.
    stop : {"both", "displacement", "residual"}
        What has to be below the tolerance: the relative change of displacement and traction
        ("both", the paper's), that of the displacement, or the residual of the law.
    max_iterations : int
        Iterations after which a solve ends "not converged".
    start : str
        "zero", "frictionless" (σ_t = 0, u_t = u_0), or a result file to start from, "FILE.h5", or
        "FILE.h5:3" for its first 3 increments. It is relative to the config, as other files are.
    formulation : {"condensed", "full"}
        Whether the system is eliminated once to u_t = u_0 + Sσ_t, or solved as a whole for every ρ,
        as in the paper.
    """

    name: Annotated[str | None, one_of(METHODS)] = None
    rule: Annotated[str | None, one_of(RULES)] = None
    rho: Positive | None = None
    omega: Annotated[float, pydantic.Field(strict=True, gt=0.0, lt=2.0)] = 1.8
    tau: Positive = 2.0
    max_changes: Count = 10
    change_test: Literal["ratio", "literal"] = "ratio"
    tolerance: Annotated[float, pydantic.Field(strict=True, gt=0.0, lt=1.0)] = 1e-6
    stop: Literal["both", "displacement", "residual"] = "both"
    max_iterations: Annotated[int, pydantic.Field(ge=1, le=10**9, strict=True)] = 1000
    start: Annotated[str, pydantic.Field(min_length=1)] = "zero"
    formulation: Literal["condensed", "full"] = "condensed"

    @property
    def resolved_name(self) -> str:
        """The method, its default filled in."""
        return self.name or ("projection" if self.rule else DEFAULT_METHOD)

    @property
    def ignored(self) -> list[str]:
        """Keys that are given, and that the method and its rule do not read."""
        name = self.resolved_name
        readers = {name, (self.rule or DEFAULT_RULE) if name == "projection" else name}
        return [
            key
            for key, names in READ_BY.items()
            if key in self.model_fields_set
            and not readers & {*names}
            and getattr(self, key) is not None
        ]


class Bem(Model):
    """The `[bem]` table: how the boundary operators are stored; the same keys exist as `-bem_...`
    options.

    In a config::

        [bem]
        mat_type = "hodlr"
        hodlr_tol = 1e-12

    Attributes
    ----------
    mat_type : {"auto", "dense", "hodlr", "hmatrix"}
        Dense, compressed hierarchically (hodlr in 2D, hmatrix in 3D), or what is cheaper.
    hodlr_tol : float, in 2D
        Relative tolerance of the compression [-].
    hmatrix_tol : float, in 3D
        Relative tolerance of the compression [-].
    hodlr_leaf : int, in 2D
        Largest number of nodes in a dense diagonal block.
    quadrature_tol : float, optional, in 3D
        Relative error of the integrals over panels in 3D, by default 1e-11 on flat and 1e-9 on
        curved ones, which leave 1e-8 of the kernels; 1e-11 leaves 2e-10. The plane's integrals are
        closed forms [-].
    """

    mat_type: Literal["auto", "dense", "hodlr", "hmatrix"] = "auto"
    hodlr_tol: Annotated[float, pydantic.Field(strict=True, gt=0.0, lt=1e-1)] = 1e-10
    hmatrix_tol: Annotated[float, pydantic.Field(strict=True, ge=1e-7, lt=1e-1)] = 1e-4
    hodlr_leaf: Annotated[int, pydantic.Field(ge=8, le=10**6, strict=True)] = 100
    quadrature_tol: Annotated[float, pydantic.Field(strict=True, ge=1e-13, le=1e-3)] | None = None


Order = Annotated[int, pydantic.Field(ge=0, le=5, strict=True)]
Ratio = Annotated[float, pydantic.Field(strict=True, gt=0.0, lt=1.0)]


class MeshOptions(Model):
    """Element size, order and grading.

    In a config::

        [mesh]
        element_size = 0.1
        order = 2

    Attributes
    ----------
    element_size : float, optional
        h: a side of length l has round(l/h) equal elements, at least one [length].
    element_sizes : dict of part name to float
        h of single parts, over `element_size`.
    order : int, optional
        Order of the elements, 0 (constant, as in the paper; the default where `element_size` is
        given) to 5.
    grading : float, optional, in 2D, axial
        Ratio in (0, 1) of neighbouring elements where the mesh is graded geometrically towards
        corners, ends of parts and `graded_points`; by default no grading where `element_size` is
        given, else 0.35.
    levels : int, in 2D, axial
        Number of graded elements towards each such point.
    graded_points : list of points, in 2D, axial
        Further points of the boundary to grade towards [length]. On contact parts of adaptive
        solves they are a first guess of transition points.
    accuracy : float, optional
        Where neither sizes nor order nor grading are given, the solve is adaptive: it refines until
        the estimated relative error is below this [-]; of u_t of one body in bilateral contact
        (1e-4 by default), else of pressure and shear (1e-2); in 3D 2e-2. Facets of .msh files are
        refined only where it is given.
    exponent : float, optional, in 3D
        3D boxes only: panels shrink towards the edges of a face with this power of their number.
        The default is 1.4; 1 makes equal panels. 3D meshes also read `element_size` (default: a
        quarter of the shortest edge), `element_sizes`, `order` (0 to 3, default 2) and `accuracy`.
        On surfaces from files the facets are the panels.
    """

    element_size: Positive | None = None
    element_sizes: dict[str, Positive] = {}  # noqa: RUF012 (frozen)
    order: Order | None = None
    grading: Ratio | None = None
    levels: Annotated[int, pydantic.Field(ge=1, le=60, strict=True)] = 12
    graded_points: tuple[Point, ...] = ()
    accuracy: Annotated[float, pydantic.Field(gt=0.0, lt=1.0)] | None = None
    exponent: Annotated[float, pydantic.Field(strict=True, ge=1.0, le=4.0)] | None = None

    @property
    def automatic(self) -> bool:
        """Whether nothing is said of sizes, order and grading: order and grading follow
        `accuracy`."""
        return (
            self.element_size is None
            and not self.element_sizes
            and self.order is None
            and self.grading is None
        )

    def ignored(self, *, adaptive: bool) -> list[str]:
        """Keys with another value than by default that a solve on this mesh, or an adaptive one,
        does not read."""
        unread = {"levels", "graded_points"} if not self.graded else set()
        unread |= {"accuracy"} if not self.automatic else set()
        if adaptive:
            unread = set(MeshOptions.model_fields) - {"graded_points", "accuracy"}
        return [
            key
            for key, field in MeshOptions.model_fields.items()
            if key in unread and getattr(self, key) != field.get_default(call_default_factory=True)
        ]

    @property
    def graded(self) -> bool:
        """Whether elements shrink towards singular points."""
        return self.grading is not None or self.element_size is None

    @property
    def resolved_order(self) -> int:
        """The order, its default filled in: 0 on uniform meshes as in the paper, 3 on graded
        ones."""
        if self.order is not None:
            return self.order
        return 0 if self.element_size is not None else 3

    @property
    def resolved_grading(self) -> float:
        """The ratio, its default filled in."""
        return self.grading if self.grading is not None else 0.35
