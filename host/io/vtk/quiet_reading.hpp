// Runs VTK's readers one at a time, and keeps what they complain about instead of printing it.
#pragma once

#include <functional>
#include <string>

namespace smurf {

// The first complaint of `read`, in one line; empty when there was none. Readers go on after errors, so that what they
// hand out must not be used then.
std::string complaint_of(const std::function<void()>& read);

}  // namespace smurf
