// The scenes that come with Tactus: each begins without a warning, and those that nobody films have no
// cameras.
#include <fstream>
#include <sstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class ShippedScenes : public ProgramTest {};

TEST_F(ShippedScenes, BeginWithoutAWarning) {
  int ran = 0;
  for (const auto& entry : fs::directory_iterator(TACTUS_SOURCE_DIR "/scenes")) {
    const std::string text = read(entry.path());
    const bool needs_data =
        text.find("$TACTUS_DATA") != std::string::npos || text.find("kind: videos") != std::string::npos;
    if (entry.path().extension() != ".yaml" || (needs_data && std::getenv("TACTUS_DATA") == nullptr))
      continue;
    const Outcome o = run_tactus("run " + entry.path().string() +
                                 " --frames 3 --view none --devices cpu --json " + path("r.json"));
    EXPECT_EQ(o.code, 0) << entry.path() << "\n" << o.text;
    EXPECT_EQ(o.text.find("warning"), std::string::npos) << entry.path() << "\n" << o.text;
    const nlohmann::json json = read_json("r.json");
    for (const nlohmann::json& notice : json["notices"]) EXPECT_EQ(notice["severity"], "info") << notice;
    ++ran;
  }
  EXPECT_GE(ran, 14);
}

}  // namespace
}  // namespace tactus::test
