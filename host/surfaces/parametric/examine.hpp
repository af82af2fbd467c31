// What is asked of a surface's pieces before they are taken for a surface: that they are bounded, and have an area.
#pragma once

#include <cstddef>

#include "patches/piece_source.hpp"
#include "smurf/surface.hpp"

namespace smurf {

// Of all pieces: encloses the surface but for rounding, and is larger by 1e-4 of its extent at most, but where nothing better than
// samples is known. Throws Error (input) when the surface goes to infinity, or is defined nowhere.
Bounds bounds_of(const PieceSource& source);

enum class Extension { nowhere, point, curve, surface };  // nowhere: undefined at all samples

// What a piece is, for a surface of that extent.
Extension extension_of(const PieceSource& source, std::size_t piece, double extent);

// Throws Error (input) that begins with `what`, when the weight of the piece vanishes, or comes so near to it that the
// hulls of 1024 parts along u and v do not tell it from that.
void require_weights(const BezierPiece& piece, const std::string& what);

}  // namespace smurf
