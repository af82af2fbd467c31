// smurf: batched ray, normal and curvature queries on surfaces. The whole public API.
#pragma once

#include "smurf/black_box.hpp"
#include "smurf/camera.hpp"
#include "smurf/compare.hpp"
#include "smurf/device.hpp"
#include "smurf/error.hpp"
#include "smurf/flow.hpp"
#include "smurf/image.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/lines.hpp"
#include "smurf/mesh.hpp"
#include "smurf/patch.hpp"
#include "smurf/rays.hpp"
#include "smurf/render.hpp"
#include "smurf/surface.hpp"
#include "smurf/volume.hpp"
