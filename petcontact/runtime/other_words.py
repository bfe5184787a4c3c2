"""What words of other programs and of handbooks are called here, or that there is no such thing."""

from __future__ import annotations

import math

SYNONYMS = {
    "mu": "friction_coefficient",
    "gravity": "acceleration",
    "omega": "angular_velocity",
    "file": "points",
    "csv": "points",
    **dict.fromkeys(("wear_rate", "archard", "k", "wear"), "wear_coefficient"),
    "alpha": "thermal_expansion",
    "rho": "density",
    "temp": "temperature",
    "displacements": "displacement",
    "g": "friction_bound",
    "bound": "friction_bound",
    "E": "young_modulus",
    "nu": "poisson_ratio",
    "h": "element_size",
    "size": "element_size",
    "p": "order",
    "type": "condition",
    "dirichlet": "displacement",
    "neumann": "traction",
    "load": "traction",
    "free": "traction",
    "block": "rectangle",
    **dict.fromkeys(("cuboid", "cube", "brick"), "box"),
    "ball": "sphere",
    "axisymmetric": "axial",
    "solver": "method",
    "newton": "semismooth-newton",
    "swt": "smith-watson-topper",
    "mises": "von_mises",
    "ln": "log",
    **dict.fromkeys(("run", "calculate", "compute", "analyse", "start"), "solve"),
    **dict.fromkeys(("manual", "man", "docs", "tutorial", "gallery"), "help"),
    **dict.fromkeys(("new", "create"), "init"),
    **dict.fromkeys(("friction", "cof", "coefficient"), "friction_coefficient"),
    **dict.fromkeys(("frictional", "tresca", "coulomb", "interaction", "pair"), "contact"),
    "cylinder": "outline",
    **dict.fromkeys(("disc", "disk"), "circle"),
    "bodies": "body",
    **dict.fromkeys(
        ("set", "nset", "elset", "nodeset", "surface", "group", "face", "side"), "part"
    ),
    **dict.fromkeys(("bc", "bcs", "support", "supports", "constraint", "constraints"), "boundary"),
    **dict.fromkeys(("slave", "source", "contact_surface"), "secondary"),
    **dict.fromkeys(("master", "target", "target_surface"), "primary"),
    **dict.fromkeys(("tie", "tied", "glued", "welded"), "bonded"),
    **dict.fromkeys(("no separation", "no-separation", "sliding"), "bilateral"),
    **dict.fromkeys(("hard", "standard", "separable"), "unilateral"),
    **{f"s{a}{b}": f"sigma_{a}{b}" for a in "xyz" for b in "xyz"},
    **{f"s{k}{k}": f"sigma_{a}{a}" for k, a in enumerate("xyz", 1)},
}
"""One word for another, where there is the other one."""
MOTIONS = ("ux", "uy", "uz", "u1", "u2", "u3", "dx", "dy", "dz")
EXPLAINED = {
    ("roller", "slider", "sliding_support"): (
        'a roller is condition = "displacement" with value = ["free", 0.0]'
    ),
    ("fixed", "clamped", "encastre", "pinned", "hinge", "fixed_support", "built-in"): (
        'a support is condition = "displacement" with value = [0.0, 0.0], "free" where it slides'
    ),
    ("steel", "aluminium", "aluminum", "titanium", "copper", "iron", "brass"): (
        "a material is its numbers, such as { young_modulus = 210_000.0, poisson_ratio = 0.3 } for "
        "steel in MPa"
    ),
    ("locked",): (
        'a preload is "locked" by a [[step.contact]] after the step that has reached it; a support '
        'is condition = "displacement" with value = [0.0, 0.0]'
    ),
    ("pressure", "dload", "dsload"): (
        'a pressure is condition = "traction" with pressure = p, p > 0 presses'
    ),
    ("force", "forces", "cload", "point_load"): (
        'a force over a part is condition = "traction" with value = force / area; [[point_force]] '
        "acts inside, and an [[obstacle]] takes a force"
    ),
    MOTIONS: 'a displacement is value = [ux, uy], "free" in a component that is not held',
    ("body",): '[[step.boundary]] with body = "...", part = "..." changes a condition of a body',
    ("gravity", "weight"): (
        "weight is [loads] acceleration = [0.0, -9810.0] with material.density (mm/s², t/mm³)"
    ),
    ("time", "duration", "dt", "t"): "nothing depends on time; increments = 4 divides a step",
    ("output", "outputs", "results"): "results go to OWN.h5, or `petcontact solve -o FILE.h5`",
    ("spring", "springs", "elastic_support", "winkler"): (
        "there are no springs; `petcontact help operators` makes a bed of them by a superelement"
    ),
    ("penalty", "fkn", "ftoln", "contact_stiffness", "augmented", "lagrange"): (
        "contact needs no penalty and no stiffness of its own; leave it out"
    ),
    (
        "yield_stress",
        "yield_strength",
        "yield",
        "plasticity",
        "plastic",
        "hardening",
    ): ("materials are linear elastic; compare the largest von Mises stress with the yield stress"),
    ("creep", "viscoelastic", "relaxation"): "materials are linear elastic, and forget nothing",
    ("hyperelastic", "neo-hooke", "mooney-rivlin", "rubber"): (
        "materials are linear elastic; rubber at small strains has poisson_ratio = 0.499"
    ),
    ("orthotropic", "anisotropic", "composite", "layer", "coating"): (
        "materials are isotropic; other ones come as superelements, see `petcontact help operators`"
    ),
    ("shell", "beam", "truss", "membrane", "plate"): (
        "bodies are solid; shells and beams come as superelements, see `petcontact help operators`"
    ),
    ("dynamics", "dynamic", "impact", "modal", "frequency", "damping", "inertia"): (
        "loads are applied slowly, there are no dynamics; [loads] has acceleration and rotation"
    ),
    ("nlgeom", "large deformation", "large displacement", "buckling"): (
        "displacements and strains are small: no large deformations, no buckling"
    ),
    ("lubrication", "fluid", "lubricant"): (
        "there is no fluid; a dry contact with a small friction_coefficient is the nearest to it"
    ),
    ("frictional", "friction contact", "rough friction"): (
        "friction is friction_coefficient or friction_bound beside it"
    ),
    ("none", "null", "nan"): 'a component that is not held is "free"',
    ("width", "height", "length", "depth", "a", "b"): (
        "a rectangle has lower_left and upper_right, a box lower and upper"
    ),
    ("diameter", "d"): "give the radius, half of it",
    ("circle", "disc", "disk"): (
        'a disc is shape = "outline", loops = [{ part = "rim", center = [0.0, 0.0], radius = 1.0 }]'
    ),
    ("velocity", "speed"): "nothing depends on time; give a displacement, in a [[step]] for a path",
    ("dimension", "dim", "dimensions"): "the shape says it: a rectangle is plane, a box in space",
    ("augmented lagrangian", "augmented-lagrangian", "lagrange multiplier", "penalty method"): (
        "contact is exact here, leave the method out"
    ),
    ("mumps", "superlu", "pardiso", "direct", "iterative"): (
        "linear solvers are PETSc's: the table [petsc], or options as -ksp_type on the command line"
    ),
    ("quadratic", "linear", "constant", "second"): "0 is constant, 1 linear, 2 quadratic",
    ("elements", "divisions", "number_of_elements"): "element_size says how large elements are",
    ("shear_modulus", "bulk_modulus", "stiffness", "G"): (
        "give young_modulus and poisson_ratio; E = 2 G (1 + nu) = 3 K (1 - 2 nu)"
    ),
    ("rough",): 'no slip at all is normal = "bonded", or a friction_coefficient of 1 and more',
    ("frictionless",): "contact without friction_coefficient and friction_bound is frictionless",
}
"""What is written instead, or why there is nothing, by the words that people try."""
ATTRIBUTES = {
    ("x", "nodes", "points", "coordinates", "places"): (
        "nodes in contact: .pairs[NAME].x, of a body: .meshes[BODY].x"
    ),
    ("p", "pressures", "contact_pressure", "pressure", "sigma_n", "normal_stress"): (
        "of a contact: .pairs[NAME].pressure"
    ),
    ("q", "shear", "tau", "sigma_t", "shear_stress", "friction_stress"): (
        "of a contact: .pairs[NAME].sigma_t"
    ),
    ("slips", "slip", "sliding", "sticks", "stick", "open", "states", "status"): (
        "of a contact: .pairs[NAME].slip, and .state of each node: 0 sticks, 1 slips, 2 is open"
    ),
    ("stress", "stresses", "sigma", "von_mises", "mises", "principal", "s"): (
        "stress at points: .stress_at(points), .von_mises_at(points)"
    ),
    ("displacement", "displacements", "u", "ux", "uy", "deformation"): (
        "of a body: .bodies[NAME].u, at points inside: .at(points)"
    ),
    ("force", "forces", "reaction", "resultant", "moment"): (
        "of a contact: .pairs[NAME].force, of supports: .reactions()"
    ),
    ("gap", "gaps", "overlap", "penetration"): "of a contact: .pairs[NAME].gap",
    ("field", "fields", "plot", "draw", "show", "figure"): (
        "figures: .plot(), petcontact.deformed_figure(solution); fields: .state_at(points)"
    ),
    ("solve", "run"): "petcontact.solve(problem)",
}
"""Where a solution has what people ask it for."""
SAID = {word: text for words, text in EXPLAINED.items() for word in words}
IN_MM_AND_N = {
    **{"Pa": 1e-6, "kPa": 1e-3, "MPa": 1.0, "GPa": 1e3, "psi": 6.894757e-3, "ksi": 6.894757},
    **{"m": 1e3, "cm": 10.0, "mm": 1.0, "µm": 1e-3, "um": 1e-3, "in": 25.4, "kN": 1e3, "N": 1.0},
    **{"rad/s": 1.0, "rpm": math.pi / 30.0, "1/min": math.pi / 30.0},
}
"""Units of lengths, forces, stresses and angular velocities in those of mm, N, rad and s."""
