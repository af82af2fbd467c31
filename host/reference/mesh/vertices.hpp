// Normals and curvature at the vertices of a mesh, in double precision.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "smurf/mesh.hpp"

namespace smurf {

// The unit normal of (b-a) x (c-a).
glm::dvec3 triangle_normal(const Mesh& mesh, std::size_t face);

// Per vertex the triangles' unit normals weighted by the angle that they take at the vertex (Thürmer, Wüthrich 1998),
// which does not depend on how the surface is cut into triangles; 0 where they cancel, and at vertices without
// triangles.
std::vector<glm::dvec3> vertex_normals(const Mesh& mesh);

// Per vertex the derivative of the unit normal along the surface: a symmetric tensor with the normal in its null space,
// by jets (Cazals, Pouget 2005, "Estimating differential quantities using polynomial fitting of osculating jets"). A
// polynomial of degree 4 in the plane of the vertex normal is fitted by least squares to the vertex and its rings of
// neighbours, two at least and as many as give a fifth more points than coefficients; where the mesh has fewer points
// than that, one of lower degree. Nothing of the triangles but who is a neighbour goes in. NaN at non-manifold
// vertices, where the normals cancel, and where there are too few points (below 6) or they lie on a line.
std::vector<glm::dmat3> jet_tensors(const Mesh& mesh);

}  // namespace smurf
