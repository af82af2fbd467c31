#include <fmt/format.h>
#include <fmt/ranges.h>

#include <system_error>

#include "cli/gallery.hpp"
#include "smurf/error.hpp"

namespace smurf {

namespace {

std::string escaped(const std::string& text) {
  std::string html;
  for (const char c : text) {
    if (c == '<') html += "&lt;";
    else if (c == '>') html += "&gt;";
    else if (c == '&') html += "&amp;";
    else if (c == '"') html += "&quot;";
    else html += c;
  }
  return html;
}

std::string table_of(const GalleryFigure& figure) {
  if (figure.head.empty()) return {};
  std::string html = "<table><tr>";
  for (const std::string& cell : figure.head) html += "<th>" + escaped(cell) + "</th>";
  html += "</tr>\n";
  for (const auto& row : figure.rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escaped(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

constexpr const char* style =
    "body{font-family:sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#1a1c21}"
    "figure{display:inline-block;margin:0 1em 1em 0;vertical-align:top}img{max-width:100%;display:block}"
    "pre{background:#f2f2ef;padding:.6em;overflow-x:auto}td,th{padding:.15em 1em .15em 0;text-align:left}";

}  // namespace

std::string gallery_page(const std::vector<GalleryFigure>& figures, const std::string& device) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>smurf: gallery</title><style>{}</style>"
      "</head><body>\n<h1>smurf: gallery</h1>\n<p>The figures of L&ouml;ffelmann, Theu&szlig;l, K&ouml;nig, "
      "Gr&ouml;ller: SMURF, a smart surface model for advanced visualization techniques (1999), made again. "
      "Device: {}.</p>\n",
      style, escaped(device));
  for (const GalleryFigure& figure : figures) {
    html += fmt::format("<h2>{}</h2>\n<p>{}</p>\n", escaped(figure.title), escaped(figure.text));
    for (std::size_t i = 0; i < figure.pictures.size(); i++) {
      html += fmt::format("<figure><img src=\"{}\" alt=\"{}\"><figcaption>{}</figcaption></figure>\n",
                          escaped(figure.pictures[i]), escaped(figure.captions[i]), escaped(figure.captions[i]));
    }
    html += table_of(figure);
    html += fmt::format("<pre>{}</pre>\n<p>Made in {:.2f} s.</p>\n",
                        escaped(fmt::format("{}", fmt::join(figure.commands, "\n"))), figure.seconds);
  }
  return html + "</body></html>\n";
}

std::filesystem::path data_folder(const std::filesystem::path& asked_for) {
  std::vector<std::filesystem::path> places;
  std::error_code failed;
  if (!asked_for.empty()) {
    places = {asked_for};
  } else {
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed);
    if (!failed) places.push_back(program.parent_path().parent_path() / "share" / "smurf");
    places.emplace_back(SMURF_DATA_FOLDER);
  }
  std::string looked;
  for (const std::filesystem::path& place : places) {
    if (std::filesystem::is_regular_file(place / "headsq.json", failed)) return place;
    looked += fmt::format("{}{}", looked.empty() ? "" : " and ", place.string());
  }
  throw Error(ErrorCode::usage, fmt::format("no headsq.json in {}; --data tells where smurf's data is", looked));
}

}  // namespace smurf
