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

/// Each is read, its bodies are made, and its probes lie in them.
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

/// The scalpel enters the liver in the 10th of 25 frames and has gone some 6 cm in the last: the walls of
/// half that length and 1 cm depth are the least that it must have cut. A liver that blows up has no wall.
TEST_F(ShippedScenes, ALiverIsCutAndBleeds) {
  for (const std::string scene : {"fig18-scalpel", "fig19-bleeding"}) {
    const Outcome o = run_tactus("run " TACTUS_SOURCE_DIR "/scenes/" + scene +
                                 ".yaml --frames 25 --view none --devices cpu --json " + path("r.json"));
    ASSERT_EQ(o.code, 0) << o.text;
    const nlohmann::json json = read_json("r.json");
    ASSERT_FALSE(json["cuts"].empty()) << scene;
    const nlohmann::json& cut = json["cuts"][0];
    EXPECT_GT(cut["area_m2"], 2 * 0.03 * 0.01) << scene;
    EXPECT_EQ(cut["blood_ml"] > 0.0, scene == "fig19-bleeding");
    for (const nlohmann::json& notice : json["notices"]) EXPECT_NE(notice["code"], "body.blew_up") << notice;
  }
}

}  // namespace
}  // namespace tactus::test
