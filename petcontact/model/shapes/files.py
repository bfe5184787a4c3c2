"""Shapes that a file describes: meshes, and bodies condensed by any code."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import pydantic

from ...errors import InputError
from ...geometry.cad.part import LARGEST as LARGEST_CAD
from ...geometry.cad.part import CadSurface, cad_surface, is_cad
from ...geometry.condensed_surface import LARGEST, CondensedSurface, read_superelement
from ...geometry.gmsh import gmsh_outline, read_msh
from ...geometry.gmsh_bodies import body_of
from ...geometry.gmsh_surface import gmsh_surface, is_surface
from ...geometry.outline import Outline
from ...geometry.surface import FacetSurface
from ...given.tables.base import Shape, regular_file

LARGEST_MESH = 2_000_000_000
"""Bytes of a mesh file."""


PartName = Annotated[str, pydantic.Field(min_length=1)]
SolidName = Annotated[str, pydantic.Field(min_length=1)]
SurfaceNumber = Annotated[int, pydantic.Field(strict=True, ge=1)]


class Gmsh(Shape):
    """A `.msh` file, format 2.2 or 4.1, of a 2D body or of the surface of a 3D body.

    In space the triangles and quadrilaterals of the physical surfaces become panels, curved where
    cells of second order are; in 2D each boundary line of the mesh is a side of its own and
    so one element at least, and lines of second order become circular arcs through their three
    nodes. Where the file has the cells of the body, only what belongs to one of them counts.

    Or a solid of a CAD file (.step, .stp, .iges, .igs, .brep), by Gmsh (`scripts/setup --cad`):
    curved quadrilaterals of about mesh.element_size, at least eight around a full circle, and
    triangles where they do not fit. Without a [mesh] the meshes adapt themselves. Parts are the
    surfaces' names in a STEP file, else their numbers, which `petcontact mesh part.step` lists.
    Lengths are in millimetres, as OpenCASCADE reads them.

    In a config::

        [geometry]
        shape = "gmsh"
        file = "bracket.msh"

    Attributes
    ----------
    shape : "gmsh"
        The shape.
    file : str
        Path of the file; in a config it is relative to the config's folder.
    parts : table of lists of int, optional, in 3D
        Names for the surfaces of a CAD file, each with the numbers of its surfaces; the others
        keep their own.
    solid : str or int, optional, in 3D
        Name or number of the solid that is this body, where a CAD file has several.
    surface : str, optional
        Name of the physical surface (3D: volume, of tetrahedra) that is this body, where a .msh
        file has several.
    """

    shape: Literal["gmsh"] = pydantic.Field(default="gmsh", kw_only=True)
    file: str = pydantic.Field(min_length=1)
    parts: dict[PartName, tuple[SurfaceNumber, ...]] | None = None
    solid: SolidName | SurfaceNumber | None = None
    surface: PartName | None = None

    @pydantic.model_validator(mode="after")
    def _keys_of_cad(self) -> Gmsh:
        for key in ("parts", "solid"):
            if getattr(self, key) is not None and not is_cad(self.file):
                raise InputError(
                    f"{key}: is for CAD files (.step, .iges, .brep); "
                    "a .msh file has physical surfaces"
                )
        if self.surface is not None and is_cad(self.file):
            raise InputError("surface: is for .msh files; a CAD file has solids")
        numbers = [number for numbers in (self.parts or {}).values() for number in numbers]
        for number in numbers:
            if numbers.count(number) > 1:
                raise InputError(f"parts: surface {number} is named twice")
        return self

    def outline(self, axial: bool = False) -> Outline | FacetSurface | CadSurface:
        """The outline, or the surface where the nodes do not lie in a plane z = const; of a half
        section of a body of revolution the lines on the axis x = 0 need no physical group. Where
        the file has cells, what of their boundary is in no group is the part "unnamed", free.

        Raises
        ------
        InputError
            If the file cannot be read, names no part somewhere, or its boundary lines or surface do
            not close.
        """
        if is_cad(self.file):
            return cad_surface(str(regular_file(self.file, LARGEST_CAD)), self.parts, self.solid)
        mesh = read_msh(str(regular_file(self.file, LARGEST_MESH)))
        if self.surface is not None:
            mesh = body_of(mesh, self.file, self.surface)
        if is_surface(mesh):
            return gmsh_surface(mesh, self.file)
        return gmsh_outline(mesh, self.file, axial)


class Superelement(Shape):
    """A body of any code, known by the condensed stiffness or compliance of its contact surface.

    Anisotropic, layered or shell bodies, from finite elements: `petcontact help superelements` says
    what the file holds. Conditions on its parts work; loads inside are in the file. The material is
    that of the surface: it says how stiff the faces are against tractions that finite elements of
    their size do not resolve. Fields inside are not known.

    In a config::

        [geometry]
        shape = "superelement"
        file = "layer.npz"

    Attributes
    ----------
    shape : "superelement"
        The shape.
    file : str
        Path of the .npz file; in a config it is relative to the config's folder.
    """

    has_inside: ClassVar[bool] = False
    shape: Literal["superelement"] = pydantic.Field(default="superelement", kw_only=True)
    file: str = pydantic.Field(min_length=1)

    def outline(self) -> CondensedSurface:
        """The contact surface.

        Raises
        ------
        InputError
            If the file cannot be read, or does not hold what it should.
        """
        return read_superelement(regular_file(self.file, LARGEST))
