// Which keys a mapping of a scene may have: unknown, double and missing ones, and old spellings.
#include <gtest/gtest.h>

#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"

namespace tactus {
namespace {

std::string error_of(const std::string& text) {
  return test::message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
}

TEST(SceneFile, UnknownKeyNamesTheNearest) {
  EXPECT_EQ(error_of("source: {kind: synthetic}\nreconstruction:\n  resoluton: 64\n"),
            "scenes/x.yaml:3: unknown key 'resoluton' in 'reconstruction'; did you mean 'resolution'?");
  EXPECT_EQ(error_of("source: {kind: synthetic}\nbodeis: []\n"),
            "scenes/x.yaml:2: unknown key 'bodeis'; did you mean 'bodies'?");
  EXPECT_EQ(
      error_of("source: {kind: synthetic}\ncontact:\n  wobble: 1\n"),
      "scenes/x.yaml:3: unknown key 'wobble' in 'contact'; known: sample_spacing_m, friction, response, "
      "restitution, bodies, self, cut_walls, every");
  EXPECT_EQ(
      error_of(
          "source: {kind: synthetic}\nbodies:\n  - name: a\n    shape: {kind: box}\n    spacing_mm: 4\n"),
      "scenes/x.yaml:5: unknown key 'spacing_mm' in 'bodies[0]'; did you mean 'spacing_m'?");
}

TEST(SceneFile, DuplicateKey) {
  EXPECT_EQ(error_of("source: {kind: synthetic}\ncontact:\n  friction: 1\n  friction: 2\n"),
            "scenes/x.yaml:4: duplicate key 'friction' in 'contact'");
  EXPECT_EQ(error_of("source: {kind: synthetic}\nname: a\nname: b\n"),
            "scenes/x.yaml:3: duplicate key 'name'");
}

/// The spelling from before a key got the field's term has its effect, with a warning that names the new one.
TEST(SceneFile, OldSpellingOfAKeyStillWorks) {
  const std::string body =
      "source: {kind: none}\nbodies:\n  - name: a\n    shape: {kind: box, size_m: [0.1, 0.1, 0.1]}\n"
      "    material: {model: tled}\n    cuttable: true\n";
  testing::internal::CaptureStderr();
  const Scene scene = parse_scene(body + "    cut_room: 321\n", "scenes/x.yaml");
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(scene.bodies.at(0).cut_capacity, 321);
  EXPECT_NE(said.find("scenes/x.yaml:7: 'cut_room' in 'bodies[0]' is now spelt 'cut_capacity'"),
            std::string::npos)
      << said;
  EXPECT_EQ(error_of(body + "    cut_room: 321\n    cut_capacity: 300\n"),
            "scenes/x.yaml:8: duplicate key 'cut_capacity' in 'bodies[0]'");
}

TEST(SceneFile, MissingKey) {
  EXPECT_EQ(error_of("name: a\n"),
            "scenes/x.yaml:1: the scene lacks the required key 'source': what the cameras see");
  EXPECT_EQ(error_of("name: a\nsource:\n  figure: hand\n"),
            "scenes/x.yaml:2: 'source' lacks the required key 'kind': where frames come from; `none`: nobody "
            "films, "
            "and nothing is reconstructed");
  EXPECT_EQ(error_of("source: {kind: synthetic}\nbodies:\n  - name: a\n"),
            "scenes/x.yaml:3: 'bodies[0]' lacks the required key 'shape': outline of the body");
  EXPECT_EQ(
      error_of("name: a\nsource:\n  kind: videos\n"),
      "scenes/x.yaml:2: in 'source': 'source' lacks the key 'path': the rig YAML (videos, masks, live), "
      "the folder "
      "(middlebury, kinect) or the recording");
  EXPECT_EQ(
      error_of("source: {kind: synthetic}\nbodies:\n- {name: a, shape: {kind: mesh}}\n"),
      "scenes/x.yaml:3: in 'bodies[0].shape': 'shape' lacks the key 'path': the file of the mesh or labels");
}

}  // namespace
}  // namespace tactus
