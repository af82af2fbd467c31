// A line of `smurf info`.
#pragma once

#include <string>

namespace smurf {

struct Fact {
  std::string name, value;
};

}  // namespace smurf
