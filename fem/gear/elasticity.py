"""Plane elasticity of one tooth sector: stiffness and mass, assembled by scikit-fem on curved second-order elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from skfem import Basis, BilinearForm, ElementQuad2, ElementTriP2, ElementVector, MeshQuad2, MeshTri2
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from gearbench.geometry.mesh.values import Mesh
from gearbench.rig import Material

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlaneModuli:
    """Effective in-plane constants: `modulus` E' and `poisson` nu' of the equivalent plane-stress problem."""

    modulus: float
    poisson: float

    @property
    def lame(self) -> tuple[float, float]:
        """Lame parameters of the in-plane problem."""
        shear = self.modulus / (2 * (1 + self.poisson))
        return self.modulus * self.poisson / (1 - self.poisson**2), shear


def plane_moduli(material: Material) -> PlaneModuli:
    """E' = E, nu' = nu in plane stress; E' = E/(1 - nu^2), nu' = nu/(1 - nu) in plane strain."""
    e, nu = material.youngs_modulus, material.poisson
    if material.state == "plane-stress":
        return PlaneModuli(e, nu)
    return PlaneModuli(e / (1 - nu**2), nu / (1 - nu))


# Degree that the quadrature integrates, by the nodes of an element: the products of two shape functions are of degree 4
# and, of biquadratic ones, of 4 in each direction.
DEGREE = {6: 6, 9: 9}


def assemble(mesh: Mesh, moduli: PlaneModuli) -> tuple[csr_matrix, csr_matrix]:
    """Stiffness and mass (unit thickness, unit density) of a plane mesh; unknown 2 n + c is component c of node n."""
    points, cells = mesh.points, mesh.cells
    size = cells.shape[1]
    mesh_type, element = (MeshTri2, ElementTriP2()) if size == 6 else (MeshQuad2, ElementQuad2())
    basis = Basis(mesh_type(points.T.copy(), cells.T.copy()), ElementVector(element), intorder=DEGREE[size])
    lame, shear = moduli.lame

    @BilinearForm
    def inertia(u, v, w):
        return dot(u, v)

    stiffness = linear_elasticity(lame, shear).assemble(basis)
    mass = inertia.assemble(basis)
    # By the elements' own numbers: the two faces of a crack have nodes in the same places.
    order = np.full(2 * len(points), -1)
    for node, component in np.ndindex(size, 2):
        order[2 * cells[:, node] + component] = basis.element_dofs[2 * node + component]
    if (order < 0).any():
        raise ValueError("the mesh holds a node that belongs to no element")
    return stiffness.tocsr()[order][:, order], mass.tocsr()[order][:, order]
