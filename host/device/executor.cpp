#include "device/executor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace smurf {

std::vector<std::string> names_of(const BufferGroup& group) {
  std::vector<std::string> names;
  for (const NamedBuffer& buffer : group) names.emplace_back(buffer.name);
  return names;
}

void append_group(const Program& program, std::string_view name, const BufferGroup& group,
                  std::vector<DeviceBuffer*>& buffers) {
  const auto named = program.groups.find(std::string(name));
  if (named == program.groups.end() || !std::ranges::equal(named->second, group, {}, {}, &NamedBuffer::name)) {
    throw std::logic_error(
        fmt::format("kernel {} is given the buffers {} as \"{}\", but its program names {}",
                    spec_of(program.kernel).name, fmt::join(names_of(group), ", "), name,
                    named == program.groups.end() ? "none" : fmt::format("{}", fmt::join(named->second, ", "))));
  }
  for (const NamedBuffer& buffer : group) buffers.push_back(buffer.buffer);
}

}  // namespace smurf
