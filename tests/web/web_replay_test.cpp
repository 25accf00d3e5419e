/// Reports: what is packed comes back, a report stays small, and names are text.
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/message_of.h"
#include "tactus/base/byte_io.h"
#include "tactus/base/read_file.h"
#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"
#include "tactus/web/film_sheet.h"
#include "tactus/web/replay_bytes.h"
#include "tactus/web/replay_sink.h"
#include "tactus/web/web_files.h"

namespace tactus {
namespace {

std::uint16_t word(std::string_view bytes, std::size_t vertex, std::size_t w) {
  std::uint16_t value = 0;
  std::memcpy(&value, bytes.data() + 8 * vertex + 2 * w, 2);
  return value;
}

/// As stream.js does it.
std::string unpack(std::string_view packed, std::string_view before) {
  const std::size_t count = packed.size() / 8;
  std::string out(packed.size(), '\0');
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t w = 0; w < 4; ++w) {
      const auto byte = [&](std::size_t plane) {
        return static_cast<unsigned>(static_cast<unsigned char>(packed[plane * count + i]));
      };
      const unsigned folded = byte(2 * w) | byte(2 * w + 1) << 8;
      const std::uint16_t then = !before.empty() ? word(before, i, w)
                                 : i > 0         ? word(out, i - 1, w)
                                                 : std::uint16_t{0};
      const auto now = static_cast<std::uint16_t>(then + ((folded >> 1) ^ (0U - (folded & 1U))));
      std::memcpy(out.data() + 8 * i + 2 * w, &now, 2);
    }
  return out;
}

std::string some_vertices(unsigned seed, std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < 4 * count; ++i)
    put_bytes(bytes, static_cast<std::uint16_t>(seed = seed * 1664525U + 1013904223U));
  return bytes;
}

TEST(ReplayBytes, VerticesComeBack) {
  const std::string before = some_vertices(1, 100), now = some_vertices(2, 100);
  EXPECT_EQ(unpack(pack_vertices(now, before), before), now);
  EXPECT_EQ(unpack(pack_vertices(now, ""), ""), now);
  EXPECT_EQ(pack_vertices(now, now), std::string(800, '\0')) << "what rests is zeros";
  EXPECT_EQ(pack_vertices("", ""), "");
}

TEST(ReplayBytes, CornersComeBack) {
  const std::vector<std::array<Index, 3>> triangles{{0, 1, 2}, {2, 1, 70000}, {3, 69999, 0}};
  const std::string packed = pack_corners(triangles);
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < 9; ++i) {
    std::uint32_t folded = 0;
    for (std::size_t k = 0; k < 4; ++k)
      folded |= std::uint32_t{static_cast<unsigned char>(packed[9 * k + i])} << 8 * k;
    last += (folded >> 1) ^ (0U - (folded & 1U));
    EXPECT_EQ(Index(last), triangles[i / 3][i % 3]);
  }
}

std::string inflated(const std::string& bytes, std::size_t most) {
  std::string out(most, '\0');
  uLongf size = most;
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &size,
                       reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
            Z_OK);
  out.resize(size);
  return out;
}

std::string from_base64(std::string_view text) {
  std::string out;
  std::uint32_t word = 0;
  int digits = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::string_view known = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    word = word << 6 | static_cast<std::uint32_t>(known.find(c));
    if (++digits % 4 == 0)
      for (const int shift : {16, 8, 0}) out += static_cast<char>(word >> shift & 255);
  }
  if (digits % 4 == 2) out += static_cast<char>(word >> 4 & 255);
  if (digits % 4 == 3) {
    out += static_cast<char>(word >> 10 & 255);
    out += static_cast<char>(word >> 2 & 255);
  }
  return out;
}

/// A square of two triangles, of which one is wet at first, and both later, numbered anew.
TEST(FilmSheet, VerticesKeepTheirNumbersFromFrameToFrame) {
  const Vec3f up{0, 1, 0}, a{0, 0, 0}, b{0, 0, 1}, c{1, 0, 0}, d{1, 0, 1};
  FilmSheet sheet;
  TriangleMesh first;
  first.positions_m = {a, b, c};
  first.normals = {up, up, up};
  first.triangles = {{2, 0, 1}};
  EXPECT_EQ(sheet.add(first, "\1\2\3"), "\1\2\3");
  const auto one = sheet.triangles();
  EXPECT_EQ(*one, (FilmSheet::Triangles{{0, 1, 2}})) << "from its smallest corner on";
  EXPECT_EQ(sheet.triangles(), one);
  TriangleMesh second;
  second.positions_m = {d, c, b};
  second.normals = {up, up, up};
  second.triangles = {{1, 2, 0}};
  EXPECT_EQ(sheet.add(second, "\4\5\6"), std::string("\0\6\5\4", 4)) << "the first corner is dry now";
  EXPECT_EQ(*sheet.triangles(), (FilmSheet::Triangles{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(sheet.add(first, "\1\2\3"), std::string("\1\2\3\0", 4));
  EXPECT_EQ(sheet.triangles()->size(), 2U);
}

TEST(ReplayBytes, FilmIsToldByDifferences) {
  EXPECT_EQ(pack_film("\5\1", "\2\2"), "\3\xff");
  EXPECT_EQ(pack_film("\5\1", "\2"), "\5\1") << "another number of vertices";
}

constexpr const char* kFalling = R"(
name: "<script>alert(1)</script>"
source: {kind: none, frames: 0-19, fps: 50}
bodies:
  - name: "<b>block"
    shape: {kind: box, size_m: [0.04, 0.04, 0.04]}
    spacing_m: 0.01
    material: {young_modulus_pa: 20000}
)";

class ReplayTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string missing = web_page_missing(); !missing.empty())
      GTEST_SKIP() << "without " << missing;
    path_ =
        (std::filesystem::temp_directory_path() / ("tactus-replay-" + std::to_string(::getpid()) + ".html"))
            .string();
  }
  void TearDown() override { std::filesystem::remove(path_); }

  struct Made {
    std::size_t frames;
    std::string page;
    std::vector<std::string> messages;
  };
  Made make(std::size_t most_bytes) {
    const Scene scene = parse_scene(kFalling, "scene.yaml");
    DeviceSet devices("cpu");
    const auto source = open_scene_source(scene);
    const BodyAssets assets = load_body_assets(scene);
    World world(devices, scene, assets);
    ReplaySink sink(StreamScene(scene, source->rig(), assets, {"0", "abc", "machine", "cpu"}), path_,
                    most_bytes);
    FrameLoop loop(*source, world);
    loop.add(sink);
    loop.run();
    Made made{sink.frames(), read_file(path_, 1 << 24), {}};
    EXPECT_EQ(made.page.size(), sink.bytes());
    const std::string begin = "id=\"messages\">";
    const std::size_t at = made.page.find(begin) + begin.size();
    const std::string all =
        inflated(from_base64(std::string_view(made.page).substr(at, made.page.find('<', at) - at)), 1 << 24);
    for (std::size_t i = 0; i < all.size();) {
      std::uint32_t size = 0;
      std::memcpy(&size, all.data() + i, 4);
      made.messages.push_back(all.substr(i + 4, size));
      i += 4 + size;
    }
    return made;
  }
  std::string path_;
};

TEST_F(ReplayTest, HoldsEveryFrameAndNamesAreText) {
  const Made made = make(ReplaySink::kMostBytes);
  EXPECT_EQ(made.frames, 20U);
  ASSERT_EQ(made.messages.size(), 22U) << "setting, summary, frames";
  EXPECT_EQ(made.page.find("alert(1)"), std::string::npos) << "names stand in the messages alone";
  EXPECT_EQ(made.page.find("<b>block"), std::string::npos);
  EXPECT_NE(made.messages[0].find("<script>alert(1)</script>"), std::string::npos);
  EXPECT_NE(made.messages[1].find("\"frames\":20"), std::string::npos);
  EXPECT_EQ(made.page.find("src=\"http"), std::string::npos);
  EXPECT_NE(made.page.find("default-src 'none'"), std::string::npos);
  // The block's corners stay its corners: its triangles come once.
  EXPECT_LT(made.messages[3].size(), made.messages[2].size());
}

TEST_F(ReplayTest, LeavesOutFramesWhereItWouldBeTooLarge) {
  // Stage times have other digits in each run, so the packed page is some 10 bytes shorter or longer; every
  // second frame is 680.
  const std::size_t whole = make(ReplaySink::kMostBytes).page.size();
  const Made smaller = make(whole - 300);
  EXPECT_EQ(smaller.frames, 10U);
  EXPECT_LT(smaller.page.size(), whole);
  EXPECT_NE(smaller.messages[1].find("\"every\":2"), std::string::npos);
}

TEST_F(ReplayTest, APathThatCannotBeWrittenIsRefusedBeforeTheRun) {
  const Scene scene = parse_scene(kFalling, "scene.yaml");
  const auto source = open_scene_source(scene);
  const BodyAssets assets = load_body_assets(scene);
  EXPECT_NE(test::message_of([&] {
              ReplaySink(StreamScene(scene, source->rig(), assets, {}), "/none/of/these/report.html");
            }).find("/none/of/these"),
            std::string::npos);
}

}  // namespace
}  // namespace tactus
