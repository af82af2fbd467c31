// The one family of exceptions that leaves the library. Messages say what was wrong, with which
// input, and what would be right.
#pragma once

#include <stdexcept>
#include <string>

namespace smurf {

enum class ErrorCode {
  usage,   // a call or option that cannot be meant: unknown device, unknown property
  input,   // data or a description that is wrong: truncated file, zero spacing, zero direction
  memory,  // does not fit the device or the host; the message says how much was needed
  device,  // the device or its driver failed
  io,      // a file could not be written
};

class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace smurf
