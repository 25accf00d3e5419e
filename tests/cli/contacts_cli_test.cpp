// Contacts of a body, point by point, in the JSON of a run.
#include <cmath>

#include "cli/program.h"

namespace tactus::test {
namespace {

using Vector = std::array<double, 3>;

void add(Vector& sum, const nlohmann::json& v) {
  for (std::size_t k = 0; k < 3; ++k) sum[k] += v[k].get<double>();
}
double length(const Vector& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Without gravity, a ball strikes a free block and goes back.
constexpr const char* kStruck = R"(
source: {kind: none, frames: 0-24, fps: 50}
gravity_m_s2: [0, 0, 0]
bodies:
  - name: block
    shape: {kind: box, size_m: [0.04, 0.04, 0.04]}
    spacing_m: 0.01
    material: {model: tled, young_modulus_pa: 20000}
obstacles:
  - name: ball
    kind: sphere
    radius_m: 0.01
    placement: {position_m: [0, 0.035, 0]}
    motion:
      - {time_s: 0}
      - {time_s: 0.1, displacement_m: [0, -0.01, 0]}
      - {time_s: 0.2, displacement_m: [0, 0.1, 0]}
)";

class ContactsOfARun : public ProgramTest {};

/// A body that may be cut has room for nodes of cuts; its count is of those that are there: 5^3.
TEST_F(ContactsOfARun, CountNodesThatAreThere) {
  std::string cuttable = kStruck;
  cuttable.replace(cuttable.find("spacing_m: 0.01"), 0, "cuttable: true\n    ");
  const Outcome o = run_tactus("run " + write("s.yaml", cuttable) +
                               " --frames 2 --view none --devices cpu --json " + path("r.json"));
  ASSERT_EQ(o.code, 0) << o.text;
  EXPECT_EQ(read_json("r.json")["bodies"][0]["nodes"], 125);
}

TEST_F(ContactsOfARun, AddUpToTheImpulseAndToTheMomentum) {
  const Outcome o = run_tactus("run " + write("s.yaml", kStruck) + " --view none --devices cpu --json " +
                               path("r.json") + " --contacts block");
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json json = read_json("r.json"), body = json["bodies"][0];
  ASSERT_EQ(body["contacts"].size(), json["contacts"].size());
  Vector all{};
  std::size_t points = 0;
  for (std::size_t f = 0; f < body["contacts"].size(); ++f) {
    Vector sum{}, on_ball{};
    for (const nlohmann::json& c : body["contacts"][f]) {
      EXPECT_EQ(c["other"], "ball");
      EXPECT_EQ(c["kind"], "obstacle");
      add(sum, c["impulse_N_s"]);
      add(all, c["impulse_N_s"]);
      points += c.contains("point") ? 1 : 0;
    }
    for (const nlohmann::json& c : json["contacts"][f]) add(on_ball, c["impulse_N_s"]);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += on_ball[k];
    // Impulses are floats, rounded by 6e-8 each, of sums in units of 2^-40 N s.
    EXPECT_LE(length(sum), 1e-6 * length(on_ball) + 1e-10) << "frame " << f;
  }
  EXPECT_GT(points, 0U);
  const nlohmann::json momentum = body["monitors"]["momentum_kg_m_s"].back();
  Vector left = all;
  for (std::size_t k = 0; k < 3; ++k) left[k] -= momentum[k].get<double>();
  // Each correction rounds a node's velocity by 6e-8 of it: 1e-6 if 16 of them all erred to one side.
  EXPECT_LE(length(left), 1e-6 * length(all));
  EXPECT_GT(length(all), 1e-4);
}

TEST_F(ContactsOfARun, NeedABodyOfTheSceneAndAFile) {
  const std::string run = "run " + write("s.yaml", kStruck) + " --view none --devices cpu";
  expect_refused(run + " --contacts block", 2, {"--contacts 'block'", "expected it with --json FILE"});
  expect_refused(run + " --json " + path("r.json") + " --contacts blok", 2, {"'blok'", "block"});
}

}  // namespace
}  // namespace tactus::test
