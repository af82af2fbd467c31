// What a refusal says.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "smurf/error.hpp"

namespace smurf::test {

// The message of the Error with this code that `action` throws; it is one line.
template <class Action>
std::string refusal(ErrorCode code, Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(int(error.code()), int(code)) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

// Expects an Error (input) whose message has `part` in it.
#define EXPECT_REFUSED(action, part)                                                            \
  do {                                                                                          \
    const std::string message = smurf::test::refusal(smurf::ErrorCode::input, [&] { action; }); \
    EXPECT_NE(message.find(part), std::string::npos) << "the message was: " << message;         \
  } while (false)

}  // namespace smurf::test
