// How much of a test that could go on for hours is run.
#pragma once

#include <algorithm>
#include <cstdlib>

namespace smurf::test {

// As many times more samples as $SMURF_TEST_DENSE says; usually 1.
inline int density() {
  const char* wanted = std::getenv("SMURF_TEST_DENSE");
  return wanted ? std::max(1, std::atoi(wanted)) : 1;
}

// Under sanitizers, which take ten times as long and look for other errors, tests run that part of their samples.
#ifdef __SANITIZE_ADDRESS__
inline constexpr int sanitized_part = 10;
#else
inline constexpr int sanitized_part = 1;
#endif

}  // namespace smurf::test
