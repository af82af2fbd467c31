// Device source that users write themselves.
#pragma once

#include <string_view>

namespace smurf {

// Throws Error (input) when the text is empty, longer than a megabyte, no text, does not name the function that it must
// define, or has an #include. `what` names the text in messages, `signature` is what it must define.
void require_user_source(std::string_view source, std::string_view what, std::string_view function,
                         std::string_view signature);

}  // namespace smurf
