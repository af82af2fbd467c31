// Which expressions devices compile and which they interpret, for as long as a test needs it.
#pragma once

#include <cstdlib>

namespace smurf::test {

// While it lives, devices compile expressions of at most so many operations; longer ones are interpreted.
class CompileAtMost {
 public:
  explicit CompileAtMost(const char* operations) { setenv("SMURF_COMPILE_OPERATIONS", operations, 1); }
  ~CompileAtMost() { unsetenv("SMURF_COMPILE_OPERATIONS"); }
  CompileAtMost(const CompileAtMost&) = delete;
  CompileAtMost& operator=(const CompileAtMost&) = delete;
};

}  // namespace smurf::test
