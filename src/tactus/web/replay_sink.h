#pragma once
/// A run in one file: a page that plays it without a network.
#include <atomic>
#include <deque>
#include <map>
#include <optional>

#include "tactus/base/worker.h"
#include "tactus/web/film_sheet.h"
#include "tactus/web/run_status.h"
#include "tactus/web/stream_scene.h"

namespace tactus {

/// Keeps frames, coarsely (4095 steps along each thing's longest side), and writes an HTML file after the
/// last one: the page, three, and the messages of docs/web.md, deflated. Where that is more than
/// `most_bytes`, and from 600 frames on, every second frame goes, and again. Meshes are made on a thread of
/// its own.
class ReplaySink final : public FrameSink {
 public:
  static constexpr std::size_t kMostBytes = 5'000'000;
  /// @throws Error when the program was built without the page, or the path can't be written.
  ReplaySink(StreamScene scene, std::string path, std::size_t most_bytes = kMostBytes);

  void begin(const World& world, std::optional<int> frame_count) override;
  void frame(RunFrame& frame) override;
  /// Writes the file. @throws Error (disk full, for example).
  void end(RunNotices& notices) override;
  /// Frames in the file, and its bytes.
  std::size_t frames() const { return kept_.size(); }
  std::size_t bytes() const { return bytes_; }

 private:
  using Triangles = std::vector<std::array<Index, 3>>;
  struct Block {
    BlockKind kind = BlockKind::surface;
    BlockRole role = BlockRole::other;
    std::string name;
    Vec3f color;
    float opacity = 1;
    std::uint32_t flags = 0;
    StreamGrid grid = {};
    std::string vertices = {};
    std::string film = {};
    std::shared_ptr<const Triangles> triangles = {};  ///< the same object where they are the same
    FilmSheet* sheet = nullptr;                       ///< has its vertices and triangles
    std::string key() const { return std::to_string(static_cast<std::uint32_t>(role)) + name; }
  };
  struct Frame {
    int number = 0;
    double time_s = 0;
    std::shared_ptr<const std::string> status;
    std::vector<Block> blocks;
  };
  static constexpr std::size_t kMostFrames = 600;

  void keep(const FrameSnapshot& snapshot, Frame frame);
  Block block_of(BlockKind kind, const BlockStyle& style, std::span<const Vec3f> positions_m,
                 std::span<const Vec3f> normals);
  void halve();
  /// Gives each block of a sheet all its vertices and triangles.
  void spread_sheets();
  std::string messages(const std::string& summary) const;
  static std::string packed_frame(const Frame& frame, std::map<std::string, const Block*>& before);

  StreamScene scene_;
  std::string path_;
  std::size_t most_bytes_, bytes_ = 0;
  RunStatus status_;
  CreaseMemory creases_;
  std::deque<Frame> kept_;
  std::atomic<int> every_ = 1;  ///< frames from one that is kept to the next
  int frames_ = 0;
  std::map<std::string, FilmSheet> sheets_;                        ///< by key
  std::map<std::string, StreamGrid> grids_;                        ///< by key
  std::map<std::string, std::shared_ptr<const Triangles>> shown_;  ///< the newest, likewise
  Worker worker_{3};                                               ///< last: it uses the others
};

/// The page with these messages, as one HTML file. @throws Error where the program was built without it.
std::string replay_page(std::string_view messages);

}  // namespace tactus
