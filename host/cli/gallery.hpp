// What the verb `gallery` makes: figures, and the page that shows them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace smurf {

struct GalleryFigure {
  std::string title, text;            // plain words
  std::vector<std::string> pictures;  // files beside the page
  std::vector<std::string> captions;  // one per picture
  std::vector<std::string> commands;  // that make them
  std::vector<std::string> head;      // of a table of numbers; empty: none
  std::vector<std::vector<std::string>> rows;
  double seconds = 0;
};

// One page without scripts, fonts or anything else from elsewhere.
std::string gallery_page(const std::vector<GalleryFigure>& figures, const std::string& device);

// Where the program's data is: --data, or share/smurf beside the program where it is installed, or host/data of the
// source it was built from. Throws Error (usage) where it is not.
std::filesystem::path data_folder(const std::filesystem::path& asked_for);

}  // namespace smurf
