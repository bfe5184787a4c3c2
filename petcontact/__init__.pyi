from .errors import InputError as InputError
from .errors import OutputError as OutputError
from .errors import PetcontactError as PetcontactError
from .errors import ResultError as ResultError
from .errors import SolverError as SolverError
from .fields.interior import field_at as field_at
from .fields.interior import field_on_grid as field_on_grid
from .model.bodies import Body as Body
from .model.bodies import Contact as Contact
from .model.bodies import Displacement as Displacement
from .model.bodies import Material as Material
from .model.bodies import Pair as Pair
from .model.bodies import Periodic as Periodic
from .model.bodies import Symmetry as Symmetry
from .model.bodies import Traction as Traction
from .model.bodies import Units as Units
from .model.case import load as load
from .model.cycle import Cycle as Cycle
from .model.load_steps import BoundaryChange as BoundaryChange
from .model.load_steps import Obstacle as Obstacle
from .model.load_steps import ObstacleChange as ObstacleChange
from .model.load_steps import PointForceChange as PointForceChange
from .model.load_steps import Step as Step
from .model.loads import LoadsChange as LoadsChange
from .model.loads import PointForce as PointForce
from .model.loads import VolumeLoads as VolumeLoads
from .model.problem import Problem as Problem
from .model.shapes.files import Gmsh as Gmsh
from .model.shapes.files import Superelement as Superelement
from .model.shapes.plane import Circle as Circle
from .model.shapes.plane import OutlineSide as OutlineSide
from .model.shapes.plane import Polygon as Polygon
from .model.shapes.plane import Rectangle as Rectangle
from .model.shapes.plane import SideBySide as SideBySide
from .model.shapes.revolved import Revolved as Revolved
from .model.shapes.solids import Box as Box
from .model.shapes.solids import Cylinder as Cylinder
from .model.shapes.solids import Sphere as Sphere
from .model.solver_options import Bem as Bem
from .model.solver_options import MeshOptions as MeshOptions
from .model.solver_options import Method as Method
from .pipeline.adapt.loop import adapt as adapt
from .pipeline.operators import Operators as Operators
from .pipeline.operators import operators as operators
from .pipeline.solve import solve as solve
from .results.figures.plots import plot_all as plot_all
from .results.figures.stress import deformed_figure as deformed_figure
from .results.hdf5 import write_solution as write_solution
from .results.solution import Solution as Solution
from .results.solution import read_result as read_result
from .results.solution import read_solution as read_solution
from .results.vtu.boundary import write_boundary_vtu as write_boundary_vtu
from .results.vtu.inside import write_vtu as write_vtu
from .runtime.petsc import initialise as initialise
from .sweep.store.case_table import load_case as load_case
from .sweep.store.case_table import load_sweep as load_sweep

__version__: str

# Names of before, which warn (see RENAMED in __init__.py).
Assembly = Problem
Case = Problem
load_any = load
load_assembly = load
