// docs/results.md and the JSON of the program say the same: every key that is written is explained, and every
// key that is explained is written.
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

using Keys = std::set<std::string>;

struct Documented {
  Keys always, sometimes;
};

/// The keys of the tables below "## `tactus VERB`".
Documented documented(const std::string& verb) {
  std::stringstream text;
  text << std::ifstream(TACTUS_SOURCE_DIR "/docs/results.md").rdbuf();
  Documented keys;
  bool here = false;
  std::string line;
  while (std::getline(text, line)) {
    if (line.starts_with("## ")) here = line == "## `tactus " + verb + "`";
    if (!here || !line.starts_with("| `")) continue;
    const std::string cell = line.substr(0, line.find(" | "));
    const bool sometimes = line.find("*sometimes*") != std::string::npos;
    const std::regex code("`([^`]+)`");
    for (std::sregex_iterator m(cell.begin(), cell.end(), code), end; m != end; ++m)
      (sometimes ? keys.sometimes : keys.always).insert((*m)[1]);
  }
  return keys;
}

/// "a.b[].c" for every leaf. A list without mappings in it is a leaf, "a[]"; names that differ are replaced.
void add_keys(const nlohmann::json& json, const std::string& path, Keys& keys) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      const bool stage = path == "ms" || path.ends_with(".ms");
      const std::string name = stage                                         ? "STAGE"
                               : path == "probes" || path == "probe_strains" ? "NAME"
                               : path == "opengl_sharing"                    ? "DEVICE"
                                                                             : key;
      add_keys(value, path.empty() ? name : path + "." + name, keys);
    }
  } else if (json.is_array()) {
    if (json.empty() || !json[0].is_object()) keys.insert(path + "[]");
    for (const nlohmann::json& item : json)
      if (item.is_object()) add_keys(item, path + "[]", keys);
  } else {
    keys.insert(path);
  }
}

void expect_explained(const std::string& verb, const Keys& written) {
  const Documented keys = documented(verb);
  EXPECT_GT(keys.always.size(), 5U) << verb;
  for (const std::string& key : written) {
    // An empty list shows no key of its items.
    const bool empty_list =
        key.ends_with("[]") && std::any_of(keys.sometimes.begin(), keys.sometimes.end(),
                                           [&](const auto& k) { return k.starts_with(key + "."); });
    EXPECT_TRUE(keys.always.contains(key) || keys.sometimes.contains(key) || empty_list)
        << "docs/results.md says nothing of '" << key << "' of tactus " << verb;
  }
  for (const std::string& key : keys.always)
    EXPECT_TRUE(written.contains(key)) << "tactus " << verb << " writes no '" << key << "'";
}

class ResultsDoc : public ProgramTest {
 protected:
  void run(const std::string& arguments, Keys& written) const {
    const Outcome o = run_tactus(arguments + " --json " + path("r.json"));
    ASSERT_EQ(o.code, 0) << o.text;
    add_keys(read_json("r.json"), "", written);
  }
};

TEST_F(ResultsDoc, ExplainsEveryKeyOfARun) {
  write("s.yaml",
        "source: {kind: synthetic, figure: sphere, depth_cameras: 0}\nreconstruction: {resolution: 8}\n"
        "bodies:\n  - name: block\n    shape: {kind: box, size_m: [0.3, 0.2, 0.3]}\n    spacing_m: 0.1\n"
        "    material: {model: tled}\n    moved: [{kind: half_space, path: [{time_s: 1, displacement_m: [0, "
        "0.01, 0]}]}]\n"
        "probes: [{name: top, body: block, position_m: [0, 0.1, 0]}]\n");
  Keys written;
  run("run " + path("s.yaml") + " --devices cpu --view none --frames 3 --budget 0.1ms", written);
  EXPECT_TRUE(written.contains("budget.quality_reductions[]"));
  expect_explained("run", written);
}

TEST_F(ResultsDoc, ExplainsEveryKeyOfAReconstruction) {
  Keys written;
  run("reconstruct rabbit --moving --frames 0-1 --resolution 24 --devices cpu", written);
  ASSERT_EQ(run_tactus("synth sphere --no-colors --depth-cameras 0 --cameras 6 --out " + path("film")).code,
            0);
  run("reconstruct --source masks " + path("film/rig.yaml") + " --repair-masks --resolution 24 --devices cpu",
      written);
  expect_explained("reconstruct", written);
}

TEST_F(ResultsDoc, ExplainsEveryKeyOfInfo) {
  Keys written;
  run("info", written);
  expect_explained("info", written);
}

}  // namespace
}  // namespace tactus::test
