#include "techniques/canvas.hpp"

#include <string>
#include <vector>

namespace smurf {

namespace {

std::vector<std::string> lines_of(std::string_view words, std::size_t longest) {
  std::vector<std::string> lines(1);
  for (std::size_t start = 0; start <= words.size();) {
    const std::size_t end = std::min(words.find(' ', start), words.size());
    const std::string_view word = words.substr(start, end - start);
    std::string& line = lines.back();
    if (line.empty()) line = word;
    else if (line.size() + 1 + word.size() <= longest) line.append(" ").append(word);
    else lines.emplace_back(word);
    start = end + 1;
  }
  return lines;
}

}  // namespace

void write_centred(Image& image, std::string_view words) {
  const int dot = std::max(1, std::min(image.width, image.height) / 300);
  const int room = image.width - 8 * dot;
  const auto longest = std::size_t(std::max(1, room / (glyph_advance * dot)));
  const std::vector<std::string> lines = lines_of(words, longest);
  const int line_height = (glyph_height + 4) * dot;
  const int height = int(lines.size()) * line_height;
  int widest = 0;
  for (const std::string& line : lines) widest = std::max(widest, text_width(line) * dot);
  Canvas canvas(image);
  int y = (image.height - height) / 2;
  canvas.fill((image.width - widest) / 2 - 4 * dot, y - 4 * dot, widest + 8 * dot, height + 8 * dot, canvas_paper,
              0.8f);
  for (const std::string& line : lines) {
    canvas.text((image.width - text_width(line) * dot) / 2, y + 2 * dot, line, dot);
    y += line_height;
  }
}

}  // namespace smurf
