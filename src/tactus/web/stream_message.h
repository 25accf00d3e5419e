#pragma once
/// Messages of the web stream as bytes. docs/web.md has the format.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

inline constexpr std::string_view kStreamMagic = "TCTW";
inline constexpr std::uint32_t kStreamVersion = 1;
inline constexpr std::size_t kStreamHeadBytes = 40, kBlockHeadBytes = 48;

enum class StreamKind : std::uint32_t { setting = 1, frame = 2, summary = 3 };
enum class BlockKind : std::uint32_t { surface = 1, particles = 2, lines = 3, json = 4 };
enum class BlockRole : std::uint32_t {
  other = 0,
  real = 1,
  body = 2,
  obstacle = 3,
  blade = 4,
  tool = 5,
  camera = 6,
  box = 7,
  liquid = 8,
  setting = 9,
  status = 10,
};
/// Bits of a block's flags.
inline constexpr std::uint32_t kWideIndices = 1, kHasNormals = 2, kSameTriangles = 4;
/// The same, in reports only (replay_bytes.h).
inline constexpr std::uint32_t kPacked = 8, kDifference = 16;
/// Likewise: triangles without film aren't drawn.
inline constexpr std::uint32_t kWetAlone = 64;
/// A byte a vertex stands behind the triangles: the film of liquid on it, in steps of kFilmStep_m.
inline constexpr std::uint32_t kHasFilm = 32;
inline constexpr float kFilmStep_m = 1e-5F;

struct BlockStyle {
  BlockRole role = BlockRole::other;
  std::string_view name;
  Vec3f color{0.8F, 0.8F, 0.8F};  ///< sRGB, 0 to 1
  float opacity = 1;              ///< of a surface with film, where it is dry
};

/// Where the 16-bit steps of a block begin, and how long they are.
struct StreamGrid {
  Vec3f origin_m;
  float step_m = 1;
  /// The cube around all that is finite, in 65535 steps.
  static StreamGrid around(std::span<const Vec3f> positions_m);
  friend bool operator==(const StreamGrid&, const StreamGrid&) = default;
};

/// A unit vector as two bytes of an octahedron's map: (x, y) / (|x| + |y| + |z|), folded where z < 0.
std::array<std::int8_t, 2> octahedral(Vec3f unit);

/// Appends 8 bytes a vertex: three 16-bit steps and a normal. @param normals one a vertex, or none
void put_vertices(std::string& to, std::span<const Vec3f> positions_m, std::span<const Vec3f> normals,
                  const StreamGrid& grid);

/// Collects the blocks of one message. Positions are 16-bit steps from the corner of each block's cube.
class StreamMessage {
 public:
  /// @param time_s simulated or filmed time @param captured_unix_s when the images came, since 1970
  StreamMessage(StreamKind kind, std::uint32_t frame, double time_s, double captured_unix_s);

  /// @param film a byte a vertex, or none
  void add_surface(const BlockStyle& style, const TriangleMesh& mesh, std::string_view film = {});
  /// A block of a report: vertices, then triangles, as packed by replay_bytes.h. @param flags of them
  void add_packed(BlockKind kind, const BlockStyle& style, std::size_t count, std::size_t triangles,
                  std::string_view packed, const StreamGrid& grid, std::uint32_t flags);
  /// Particles; those that aren't finite are left out.
  void add_particles(const BlockStyle& style, std::span<const Vec3f> positions_m);
  /// Straight lines between points 0 and 1, 2 and 3, ...
  void add_lines(const BlockStyle& style, std::span<const Vec3f> points_m);
  /// @param text JSON in UTF-8
  void add_json(const BlockStyle& style, std::string_view text);

  std::string take() { return std::move(bytes_); }

 private:
  /// @returns where the block's size stands, for end_block()
  std::size_t begin_block(BlockKind kind, const BlockStyle& style, std::size_t count, std::size_t triangles,
                          std::uint32_t flags, const StreamGrid& grid);
  void end_block(std::size_t size_at);
  void put_triangles(std::span<const std::array<Index, 3>> triangles, bool wide);
  void pad();

  std::string bytes_;
  std::uint32_t blocks_ = 0;
};

}  // namespace tactus
