#include "io/vtk/quiet_reading.hpp"

#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <mutex>
#include <string_view>

namespace smurf {
namespace {

// What VTK would print. Its readers report damaged data as errors, and short data as warnings.
class Complaints : public vtkOutputWindow {
 public:
  static Complaints* New() {
    auto* made = new Complaints;
    made->InitializeObjectBase();
    return made;
  }

  void DisplayText(const char*) override {}
  void DisplayDebugText(const char*) override {}
  void DisplayErrorText(const char* text) override { keep(text); }
  void DisplayWarningText(const char* text) override { keep_if_damage(text); }
  void DisplayGenericWarningText(const char* text) override { keep_if_damage(text); }

  std::string first;

 private:
  void keep(std::string_view text) {
    if (first.empty()) first = text.empty() ? "unknown error" : text;
  }
  // Others tell of a newer version of the format, and the like.
  void keep_if_damage(std::string_view text) {
    for (const std::string_view word : {"rror", "ismatch", "remature", "nexpected", "nvalid", "ailed", "annot"}) {
      if (text.find(word) != text.npos) return keep(text);
    }
  }
};

// VTK's window for messages and the verbosity of its log are one for the whole process.
class MessagesCaught {
 public:
  explicit MessagesCaught(Complaints* instead)
      : window_(vtkOutputWindow::GetInstance()),
        verbosity_(vtkLogger::GetCurrentVerbosityCutoff()),
        warnings_(vtkObject::GetGlobalWarningDisplay()) {
    vtkOutputWindow::SetInstance(instead);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
    vtkObject::SetGlobalWarningDisplay(1);
  }
  ~MessagesCaught() {
    vtkObject::SetGlobalWarningDisplay(warnings_);
    vtkLogger::SetStderrVerbosity(verbosity_);
    vtkOutputWindow::SetInstance(window_);
  }
  MessagesCaught(const MessagesCaught&) = delete;
  MessagesCaught& operator=(const MessagesCaught&) = delete;

 private:
  vtkSmartPointer<vtkOutputWindow> window_;
  vtkLogger::Verbosity verbosity_;
  int warnings_;
};

// "ERROR: In file.cxx, line 12\nvtkReader (0x55): the message\n\n": the message alone, in one line.
std::string plain(std::string text) {
  const auto line = text.find('\n');
  if (text.find("In ") < line && line != text.npos) text.erase(0, line + 1);
  if (const auto object = text.find("): "); object != text.npos && text.find("(0x") < object) text.erase(0, object + 3);
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c > '~'; }, ' ');
  while (text.ends_with(' ')) text.pop_back();
  constexpr std::size_t longest = 200;
  if (text.size() > longest) text = text.substr(0, longest) + "...";
  return text.empty() ? "unknown error" : text;
}

}  // namespace

std::string complaint_of(const std::function<void()>& read) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  const vtkNew<Complaints> complaints;
  const MessagesCaught caught(complaints);
  read();
  return complaints->first.empty() ? "" : plain(complaints->first);
}

}  // namespace smurf
