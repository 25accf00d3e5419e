// Parameters of a scene on the command line.
#include "cli/program.h"

namespace tactus::test {
namespace {

/// A block falls for half a second.
constexpr const char* kFall = R"(
source: {kind: none, frames: 0-30, fps: 60}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.04, 0.04, 0.04]}
    spacing_m: 0.01
    material: {model: tled, young_modulus_pa: 20000}
obstacles: [{name: floor, kind: plane, placement: {position_m: [0, -10, 0]}}]
)";

class Parameters : public ProgramTest {};

TEST_F(Parameters, AreSetFromTheFirstFrameOn) {
  const std::string run =
      "run " + write("s.yaml", kFall) + " --view none --devices cpu --json " + path("r.json");
  const Outcome o = run_tactus(run + " --set gravity_m_s2.y=-2 --set gravity_m_s2.x=1e0");
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json p = read_json("r.json")["bodies"][0]["monitors"]["momentum_kg_m_s"].back();
  const double mass_kg = 0.064, time_s = 0.5;
  EXPECT_NEAR(p[0].get<double>(), mass_kg * time_s, 1e-4 * mass_kg);
  EXPECT_NEAR(p[1].get<double>(), -2 * mass_kg * time_s, 1e-4 * mass_kg);
}

TEST_F(Parameters, AreListedAndRefusedByName) {
  const std::string scene = write("s.yaml", kFall),
                    run = "run " + scene + " --view none --devices cpu --set ";
  expect_refused(run + "gravity", 2, {"--set 'gravity': expected NAME=NUMBER", "info --parameters"});
  expect_refused(run + "contact.friction=much", 2, {"--set 'contact.friction=much'"});
  expect_refused(run + "contact.frictoin=1", 2, {"'contact.frictoin' is unknown", "'contact.friction'"});
  expect_refused(run + "contact.friction=11", 2, {"is 11, expected >= 0 and <= 10"});
  expect_refused(run + "bodies.block.spacing_m=0.02", 2, {"can't change while the scene runs"});
  const Outcome listed = run_tactus("info --parameters " + scene);
  EXPECT_EQ(listed.code, 0);
  EXPECT_NE(
      listed.text.find("bodies.block.material.young_modulus_pa              20000  >= 0.02 and <= 1e+09 Pa"),
      std::string::npos)
      << listed.text;
}

TEST_F(Parameters, NoFileIsWrittenTwiceOrOverTheScene) {
  const std::string scene = write("s.yaml", kFall),
                    run = "run " + scene + " --view none --devices cpu --frames 1 ";
  expect_refused(run + "--json " + scene, 2, {"--json '", "is the scene's file, too"});
  expect_refused(run + "--json " + path("a") + " --checkpoint " + path("a"), 2,
                 {"--checkpoint '", "is --json's file, too"});
  EXPECT_EQ(run_tactus(run + "--json " + path("a") + " --checkpoint " + path("b")).code, 0);
  EXPECT_EQ(run_tactus(run + "--json " + path("a") + " --checkpoint " + path("b")).code, 0) << "once more";
}

}  // namespace
}  // namespace tactus::test
