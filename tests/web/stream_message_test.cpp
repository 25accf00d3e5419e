/// Bytes of the web stream, read as docs/web.md says.
#include "tactus/web/stream_message.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tactus/base/byte_io.h"
#include "tactus/geom/mesh/sphere_surface.h"
#include "tactus/web/stream_scene.h"

namespace tactus {
namespace {

struct Block {
  std::uint32_t kind, role, size, count, triangles, flags;
  std::string name;
  std::uint8_t rgba[4];
  Vec3f origin_m;
  float step_m;
  std::string_view data;
};

struct Message {
  std::uint32_t kind, frame;
  double time_s, captured_s;
  std::vector<Block> blocks;
};

Message read(std::string_view bytes) {
  ByteReader r(bytes);
  EXPECT_EQ(r.take(4), "TCTW");
  EXPECT_EQ(r.take<std::uint32_t>(), 1U);
  Message m{};
  m.kind = r.take<std::uint32_t>();
  const auto blocks = r.take<std::uint32_t>();
  m.frame = r.take<std::uint32_t>();
  r.take<std::uint32_t>();
  m.time_s = r.take<double>();
  m.captured_s = r.take<double>();
  std::size_t at = kStreamHeadBytes;
  for (std::uint32_t i = 0; i < blocks; ++i) {
    ByteReader b(bytes.substr(at));
    Block block{};
    block.kind = b.take<std::uint32_t>();
    block.role = b.take<std::uint32_t>();
    block.size = b.take<std::uint32_t>();
    const auto name_bytes = b.take<std::uint32_t>();
    block.count = b.take<std::uint32_t>();
    block.triangles = b.take<std::uint32_t>();
    for (std::uint8_t& c : block.rgba) c = b.take<std::uint8_t>();
    block.flags = b.take<std::uint32_t>();
    for (int a = 0; a < 3; ++a) block.origin_m[a] = b.take<float>();
    block.step_m = b.take<float>();
    block.name = std::string(b.take(name_bytes));
    b.take((4 - name_bytes % 4) % 4);
    EXPECT_FALSE(b.failed());
    block.data = bytes.substr(at + block.size - (block.size - kBlockHeadBytes - (name_bytes + 3) / 4 * 4),
                              block.size - kBlockHeadBytes - (name_bytes + 3) / 4 * 4);
    at += block.size;
    m.blocks.push_back(block);
  }
  EXPECT_EQ(at, bytes.size());
  return m;
}

Vec3f position(const Block& block, std::size_t i) {
  std::uint16_t q[3];
  std::memcpy(q, block.data.data() + 8 * i, sizeof q);
  return block.origin_m + block.step_m * Vec3f{float(q[0]), float(q[1]), float(q[2])};
}

Vec3f normal(const Block& block, std::size_t i) {
  const auto u = static_cast<float>(static_cast<std::int8_t>(block.data[8 * i + 6])) / 127;
  const auto v = static_cast<float>(static_cast<std::int8_t>(block.data[8 * i + 7])) / 127;
  Vec3f n{u, v, 1 - std::abs(u) - std::abs(v)};
  const float fold = std::max(-n.z, 0.F);
  n.x += n.x >= 0 ? -fold : fold;
  n.y += n.y >= 0 ? -fold : fold;
  return normalized(n);
}

TEST(StreamMessage, SurfacesComeBackToHalfAStep) {
  TriangleMesh ball = sphere_surface(0.25F, 12);
  compute_normals(ball);
  for (Vec3f& p : ball.positions_m) p += Vec3f{3, -1, 0.5F};
  StreamMessage message(StreamKind::frame, 7, 0.25, 1e9);
  message.add_surface({BlockRole::body, "ball", {1, 0.5F, 0}, 0.5F}, ball);
  const std::string bytes = message.take();
  const Message m = read(bytes);
  EXPECT_EQ(m.kind, 2U);
  EXPECT_EQ(m.frame, 7U);
  EXPECT_EQ(m.time_s, 0.25);
  EXPECT_EQ(m.captured_s, 1e9);
  ASSERT_EQ(m.blocks.size(), 1U);
  const Block& b = m.blocks[0];
  EXPECT_EQ(b.kind, 1U);
  EXPECT_EQ(b.role, 2U);
  EXPECT_EQ(b.name, "ball");
  EXPECT_EQ(b.flags, kHasNormals);
  EXPECT_EQ(int(b.rgba[0]), 255);
  EXPECT_EQ(int(b.rgba[1]), 128);
  EXPECT_EQ(int(b.rgba[3]), 128);
  ASSERT_EQ(b.count, ball.positions_m.size());
  ASSERT_EQ(b.triangles, ball.triangles.size());
  // 0.5 m in 65535 steps; the ball of flat triangles is 0.25 % larger.
  EXPECT_NEAR(b.step_m, 0.5F / 65535, 0.003F * 0.5F / 65535);
  for (std::size_t i = 0; i < ball.positions_m.size(); ++i) {
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(position(b, i)[a], ball.positions_m[i][a], 0.51F * b.step_m + 4e-7F);  // + an ulp at 3 m
    // 1 / 127 of the map's square: at most 1.3 degrees where it is stretched most, 1.7 times, along both
    // axes.
    EXPECT_GT(dot(normal(b, i), ball.normals[i]), std::cos(1.3F * 3.14159F / 180));
  }
  for (std::size_t t = 0; t < ball.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint16_t corner = 0;
      std::memcpy(&corner, b.data.data() + 8 * b.count + 2 * (3 * t + k), 2);
      EXPECT_EQ(Index(corner), ball.triangles[t][k]);
    }
}

TEST(StreamMessage, ManyVerticesHaveWideIndices) {
  TriangleMesh large;
  large.positions_m.resize(70000);
  large.positions_m.back() = {1, 2, 3};
  large.triangles = {{0, 1, 69999}};
  StreamMessage message(StreamKind::frame, 1, 0, 0);
  message.add_surface({BlockRole::body, "large"}, large);
  const std::string bytes = message.take();
  const Message m = read(bytes);
  EXPECT_EQ(m.blocks[0].flags, kWideIndices);
  std::uint32_t corner = 0;
  std::memcpy(&corner, m.blocks[0].data.data() + 8 * 70000 + 8, 4);
  EXPECT_EQ(corner, 69999U);
}

TEST(StreamMessage, AFilmFollowsTheTriangles) {
  const TriangleMesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {{0, 1, 2}}};
  StreamMessage message(StreamKind::frame, 1, 0, 0);
  message.add_surface({BlockRole::body, "wet"}, one, std::string_view("\x00\x07\xff", 3));
  const std::string bytes = message.take();
  const Message m = read(bytes);
  EXPECT_EQ(m.blocks[0].flags, kHasFilm);
  // 3 vertices of 8 bytes, 3 corners of 2, 3 bytes of film, filled to a multiple of 4.
  EXPECT_EQ(m.blocks[0].data.size(), 36U);
  EXPECT_EQ(m.blocks[0].data.substr(30, 3), std::string_view("\x00\x07\xff", 3));
}

TEST(StreamMessage, NumbersThatAreNoneHarmNothingElse) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const std::vector<Vec3f> drops{{0, 0, 0}, {nan, 0, 0}, {1, 1, 1}, {0, inf, 0}};
  TriangleMesh torn{{{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}, {}, {{0, 1, 2}}};
  StreamMessage message(StreamKind::frame, 1, 0, 0);
  message.add_particles({BlockRole::liquid, "blood"}, drops);
  message.add_surface({BlockRole::body, "torn"}, torn);
  message.add_particles({BlockRole::liquid, "none"}, {});
  message.add_json({BlockRole::status, "status"}, "{\"a\":1}");
  const std::string bytes = message.take();
  const Message m = read(bytes);
  ASSERT_EQ(m.blocks[0].count, 2U) << "particles that are nowhere are left out";
  EXPECT_NEAR(position(m.blocks[0], 1).z, 1, 1e-4);
  EXPECT_EQ(m.blocks[1].count, 3U) << "vertices keep their numbers";
  EXPECT_NEAR(position(m.blocks[1], 1).x, 1, 1e-4);
  EXPECT_EQ(m.blocks[2].count, 0U);
  EXPECT_EQ(m.blocks[3].data.substr(0, m.blocks[3].count), "{\"a\":1}");
}

TEST(StreamScene, FrustaPointAtTheScene) {
  const Camera camera = look_at({0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 200, 100, 100);
  const std::vector<Vec3f> lines = frustum_lines(camera, 0.5);
  ASSERT_EQ(lines.size(), 16U);
  // At 0.5 m, 200 pixels of f = 100 px are 1 m wide, 100 are 0.5 m high.
  for (std::size_t i = 0; i < 16; i += 4) {
    EXPECT_NEAR(lines[i].z, 2, 1e-5);
    EXPECT_NEAR(std::abs(lines[i + 1].x), 0.5, 0.005);  // half a pixel of the principal point
    EXPECT_NEAR(std::abs(lines[i + 1].y), 0.25, 0.005);
    EXPECT_NEAR(lines[i + 1].z, 1.5, 1e-5);
  }
}

TEST(StreamScene, BoxesHaveTwelveEdges) {
  const std::vector<Vec3f> lines = box_lines({{0, 0, 0}, {1, 2, 4}});
  ASSERT_EQ(lines.size(), 24U);
  float sum = 0;
  for (std::size_t i = 0; i < 24; i += 2) sum += length(lines[i + 1] - lines[i]);
  EXPECT_NEAR(sum, 4 * (1 + 2 + 4), 1e-5);
}

}  // namespace
}  // namespace tactus
