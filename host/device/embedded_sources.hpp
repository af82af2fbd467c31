// Device sources as string constants, generated at build time (host/embed.cmake).
#pragma once

#include <string_view>
#include <vector>

namespace smurf {

struct EmbeddedSource {
  std::string_view name;  // "kernels/roots/bernstein.inc", "shaders/prelude.glsl"
  std::string_view text;
};

const std::vector<EmbeddedSource>& embedded_sources();

}  // namespace smurf
