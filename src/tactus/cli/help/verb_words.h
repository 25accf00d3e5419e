#pragma once
/// The verbs as a tree, for the texts made from them: completions and the man page.
#include <cstdint>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tactus {

enum class ValueKind : std::uint8_t { none, number, text, file, words };

struct FlagWords {
  std::string name;  ///< "--devices"; of a positional argument "scene"
  std::string help;
  ValueKind value = ValueKind::none;  ///< of the word that follows it
  std::vector<std::string> words;     ///< where the value is one of these
};

struct VerbWords {
  std::string path;  ///< "calibrate rig"; "" for the program
  std::string name, help, examples;
  std::vector<FlagWords> flags, arguments;
  std::vector<VerbWords> verbs;
};

VerbWords words_of(const CLI::App& app);
/// "of the camera, 1 to 9" -> its first line, without "\n".
std::string one_line(const std::string& text);

}  // namespace tactus
